"""Pictures as files: PNG for screens, SVG for print."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .png import encode_png
from .style import house_style

RESOLUTION = 150
"""dpi of the PNG."""


@house_style()
def save_figure(figure: Figure, stem: Path, *, png: bool = True) -> tuple[Path, ...]:
    """Write ``stem``.svg and, if wanted, ``stem``.png; of equal figures the same bytes at any time.

    Returns:
        The files, the SVG last.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    files = [stem.with_name(stem.name + suffix) for suffix in (".png", ".svg")]
    if png:
        files[0].write_bytes(_png(figure))
    figure.savefig(files[1], metadata={"Date": None, "Creator": None})
    return tuple(files if png else files[1:])


def _png(figure: Figure) -> bytes:
    with BytesIO() as drawn:
        figure.savefig(drawn, format="rgba", dpi=RESOLUTION)
        width = int(figure.get_size_inches()[0] * RESOLUTION)
        pixels = np.frombuffer(drawn.getvalue(), np.uint8).reshape(-1, width, 4)
    return encode_png(pixels[:, :, :3], RESOLUTION)
