"""The folder of pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from ...analysis.figures import save_figure


class Picture(NamedTuple):
    """A figure of the report."""

    caption: str
    path: Path

    @property
    def data(self) -> str:
        """The SVG as a data URI."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.path.read_bytes()).decode()


class Gallery(NamedTuple):
    """Where the figures go."""

    folder: Path
    png: bool
    """Whether as PNG too; the report has the SVG."""

    def hang(self, figure: Figure, stem: str) -> None:
        """Write a figure."""
        save_figure(figure, self.folder / stem, png=self.png)

    def pictures(self, captions: Iterable[tuple[str, str]]) -> list[Picture]:
        """Those of the given stems that were written, with their captions."""
        return [
            Picture(caption, path)
            for stem, caption in captions
            if (path := self.folder / f"{stem}.svg").is_file()
        ]
