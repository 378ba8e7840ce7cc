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
def save_figure(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write ``stem``.png and ``stem``.svg, of equal figures the same bytes at any time.

    Returns:
        The two files.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    png, svg = (stem.with_name(stem.name + suffix) for suffix in (".png", ".svg"))
    with BytesIO() as drawn:
        figure.savefig(drawn, format="rgba", dpi=RESOLUTION)
        width = int(figure.get_size_inches()[0] * RESOLUTION)
        pixels = np.frombuffer(drawn.getvalue(), np.uint8).reshape(-1, width, 4)
    png.write_bytes(encode_png(pixels[:, :, :3], RESOLUTION))
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg
