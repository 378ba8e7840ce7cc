"""The 3-D page of flights: shown in a notebook's cell, or written to a file and opened."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.arguments import as_path

from ..console.files import atomic_file, check_writable, make_folder
from ..console.progress import counting_progress

if TYPE_CHECKING:
    from ..view.flights import ViewOptions

HEIGHT_PX = 600


class FlightPage:
    """A self-contained page with the scene and the plots of flights, as ``space-robot view`` makes.

    As the value of a notebook's cell it is shown there.
    """

    def __init__(self, html: str, height: int = HEIGHT_PX) -> None:
        """``height``: of its frame in a notebook, px."""
        self.html, self.height = html, height

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, which is replaced if it exists, and return its path."""
        file = as_path(path, "path")
        make_folder(file.parent)
        check_writable(file)
        with atomic_file(file, replace=True) as written:
            written.write(self.html.encode())
        return file

    def __repr__(self) -> str:
        return f"<FlightPage: {len(self.html.encode()) / 1e6:.1f} MB>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html)}" allowfullscreen '
            f'style="border: 0; width: 100%; height: {self.height}px"></iframe>'
        )


def draw_page(logs: Sequence[FlightLog], robots: Sequence[Robot], options: ViewOptions) -> str:
    """Return the page of flights, named by their laws."""
    from ..view.flights import flights_page  # slow to import
    from ..view.stage import check_viser

    check_viser()
    names = unique_names([str(log.flight.get("controller", "flight")) for log in logs])
    with counting_progress("drawing", is_transient=True) as advance:
        return flights_page(
            dict(zip(names, logs, strict=True)),
            dict(zip(names, robots, strict=True)),
            options,
            advance,
        )


def unique_names(names: Sequence[str]) -> list[str]:
    """Return the names with numbers where several are the same: ``ctc``, ``ctc 2``."""
    unique: list[str] = []
    for name in names:
        count = 1
        while (candidate := name if count == 1 else f"{name} {count}") in unique:
            count += 1
        unique.append(candidate)
    return unique


def show_page(page: FlightPage, file: str | Path, opens: bool) -> None:
    """Write a page and open it in a browser; print where it is."""
    path = page.save(file)
    print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)", file=sys.stderr)
    if opens and not webbrowser.open(path.absolute().as_uri()):
        print("no browser available: open the page in one yourself", file=sys.stderr)
