"""Pictures as files: PNG for screens, SVG for print."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

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
    figure.savefig(png, dpi=RESOLUTION, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg
