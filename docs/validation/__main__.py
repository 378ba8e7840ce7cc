"""Compare the physics and the decisions of this project with independent programs.

Writes docs/validation.json, its tables into docs/validation.md, and the picture of a robot that
tumbles. Exit code 1: a difference is beyond its limit, and nothing is written.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from collections.abc import Iterator
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.append(str(Path(__file__).parents[1] / "flown"))
from marks import markdown, put

DOCS = Path(__file__).parents[1]
Array = NDArray[np.float64]
PAGE, NUMBERS, PICTURE = (DOCS / f"validation.{kind}" for kind in ("md", "json", "svg"))
PACKAGES = "space_robot", "numpy", "numba"
KEPT = "linear momentum", "angular momentum", "energy"
OURS = "space_robot, RK4"


def measure() -> tuple[list[dict[str, Any]], dict[str, Array]]:
    """Return all rows, printed one by one, and drifts by integrator."""
    sys.path += [str(DOCS.parent / folder) for folder in ("tests", "tools/benchmarks")]
    import physics
    import software
    from rows import PINOCCHIO, ValidationRow

    drifts: dict[str, Array] = {}

    def conserved() -> Iterator[ValidationRow]:
        for name in ("", *physics.INTEGRATORS):
            drifts[f"MuJoCo, {name}" if name else OURS] = physics.drifts(name)
        extent = f"{physics.DURATION_S:g} s in steps of {1e3 * physics.STEP_S:g} ms"
        drift = float(drifts[OURS][:, 1:].max())
        yield ValidationRow("momenta and energy of a free robot", PINOCCHIO, extent, drift, 1e-9)

    of_physics = physics.trees, conserved, physics.joints, physics.captures, physics.in_orbit
    of_software = software.navigation, software.allocation, software.statistics, software.bits
    sections = *of_physics, *of_software
    return [announced(row) for section in sections for row in section()], drifts


def announced(row: Any) -> dict[str, Any]:
    """Print a row; return it by names."""
    fields: dict[str, Any] = row._asdict()
    is_right = row.difference <= row.limit
    print(" | ".join(cells(fields)) + ("" if is_right else ": beyond its limit"), flush=True)
    return fields


def cells(row: dict[str, Any]) -> list[str]:
    """Return the texts of a row."""
    return [text if isinstance(text, str) else short(text) for text in row.values()]


def short(number: float) -> str:
    """Return a number with two digits, as in 3.1e-9."""
    return f"{number:.2g}".replace("e-0", "e-")


def written(page: str, numbers: dict[str, Any]) -> str:
    """Return the page with the tables of these numbers."""
    head = "compared", "with", "over", "largest difference", "limit"
    made = ", ".join(f"{name} {text}" for name, text in numbers["versions"].items())
    parts = {
        "rows": markdown(head, [cells(row) for row in numbers["rows"]]),
        "drifts": markdown(
            ("integrator", *KEPT),
            [[name, *map(short, drift)] for name, drift in numbers["drifts"].items()],
        ),
        "made": f"Made on {numbers['date']} with {made}.",
    }
    for name, part in parts.items():
        page = put(page, name, part)
    return page


def draw(drifts: dict[str, Array]) -> None:
    """Draw the drift of angular momentum over time."""
    sys.path.append(str(DOCS / "pictures"))
    import theme

    figure, (axes,) = theme.panels()
    shown = [name for name in drifts if "fast" not in name]  # the same line as Euler's
    for name, colour in zip(shown, theme.SERIES, strict=True):
        time_s, drift = drifts[name][:, [0, 2]].T
        label = f"{name}, implicitfast" if name.endswith("Euler") else name
        axes.semilogy(time_s, drift, color=colour, label=label)
    labels = {"xlabel": "time, s", "ylabel": "drift of angular momentum"}
    axes.set(**labels, xlim=(0, 600), ylim=(1e-15, 1.0))
    axes.legend(loc="center", bbox_to_anchor=(0.5, 0.57), ncols=1)
    PICTURE.write_text(theme.as_svg(figure), "utf-8")


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="make validation", description=__doc__)
    parser.parse_args()
    rows, drifts = measure()
    if any(not row["difference"] <= row["limit"] for row in rows):
        sys.exit("beyond its limit: see above")
    versions = {"Python": platform.python_version(), **{name: version(name) for name in PACKAGES}}
    largest = {name: np.max(drift, axis=0)[1:].tolist() for name, drift in drifts.items()}
    numbers = {"date": f"{date.today()}", "versions": versions, "rows": rows, "drifts": largest}
    NUMBERS.write_text(f"{json.dumps(numbers, indent=1)}\n", "utf-8")
    PAGE.write_text(written(PAGE.read_text("utf-8"), numbers), "utf-8")
    draw(drifts)


if __name__ == "__main__":
    main()
