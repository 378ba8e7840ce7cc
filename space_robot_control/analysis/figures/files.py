"""Pictures as files: PNG for screens, SVG for print."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..export import make_folder, whole_file
from .png import encode_png
from .style import house_style

RESOLUTION = 150
"""dpi of the PNG."""


@house_style()
def save_figure(figure: Figure, stem: Path, *, png: bool = True) -> tuple[Path, ...]:
    """Write ``stem``.svg and, if wanted, ``stem``.png; of equal figures the same bytes at any time.

    Older files of these names are replaced.

    Returns:
        The files, the SVG last.

    Raises:
        InputError: they cannot be written.
    """
    make_folder(stem.parent)
    files = [stem.with_name(stem.name + suffix) for suffix in (".png", ".svg")]
    if png:
        with whole_file(files[0], replace=True) as file:
            file.write(_png(figure))
    with whole_file(files[1], replace=True) as file, _without_warnings():
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return tuple(files if png else files[1:])


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Of letters that the font does not have, which are drawn as boxes."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def _png(figure: Figure) -> bytes:
    with BytesIO() as drawn, _without_warnings():
        figure.savefig(drawn, format="rgba", dpi=RESOLUTION)
        width = int(figure.get_size_inches()[0] * RESOLUTION)
        pixels = np.frombuffer(drawn.getvalue(), np.uint8).reshape(-1, width, 4)
    return encode_png(pixels[:, :, :3], RESOLUTION)
