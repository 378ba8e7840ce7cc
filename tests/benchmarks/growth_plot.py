"""The picture of the section `growth`."""

from __future__ import annotations

from pathlib import Path
from statistics import median

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .sections.growth import LARGE, Growth


def draw_growth(growth: Growth, path: Path) -> None:
    """Times over joints, both on logarithmic axes."""
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for name, sizes in growth.samples_us.items():
        exponents = growth.exponents(name, LARGE) or growth.exponents(name)
        ours = name.startswith("space_robot")
        label = f"{name}: $n^{{{median(exponents):.2f}}}$" if exponents else name
        axes.loglog(
            growth.joints,
            [median(samples) for samples in sizes],
            marker="o",
            markersize=4,
            label=label,
            linewidth=2.0 if ours else 1.2,
            linestyle="-" if ours else "--",
        )
    axes.set_xlabel("joints")
    axes.set_ylabel("time, us")
    axes.set_xticks(growth.joints, [str(n) for n in growth.joints])
    axes.minorticks_off()
    axes.grid(alpha=0.3, which="both")
    axes.set_title(f"growth with the number of joints (exponents from {LARGE} joints on)")
    axes.legend(fontsize="small")
    figure.savefig(path, format="png", dpi=150)
