"""Tables of the checks and of the growth, and its picture."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Any

from growth import LARGE, Growth
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table


def print_checks(checks: list[dict[str, Any]], console: Console) -> None:
    table = Table("peer", title="the same robot", title_justify="left", box=SIMPLE_HEAD)
    for column in ("joints", "time, s", "moved by", "apart by", "allowed", ""):
        table.add_column(column, justify="right")
    for check in checks:
        table.add_row(
            check["peer"], str(check["joints"]), f"{check['time_s']:g}", f"{check['moved']:.2g}",
            f"{check['apart']:.1e}", f"{check['tolerance']:.0e}",
            "[green]same" if check["same"] else "[red]another robot",
        )  # fmt: skip
    console.print(table)


def print_growth(growth: Growth, is_cold: bool, console: Console) -> None:
    """Times, exponents with their spread, first calls."""
    title = "growth with the number of joints, median us"
    table = Table("", title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for n in growth.joints:
        table.add_column(str(n), justify="right")
    for name in growth.samples_us:
        table.add_row(name, *(_number(value) for value in growth.medians_us(name)))
    console.print(table)
    title = "exponent of the number of joints, median and spread"
    table = Table("", title=title, title_justify="left", box=SIMPLE_HEAD)
    table.add_column("all sizes", justify="right")
    table.add_column(f"from {LARGE} joints on", justify="right")
    for name in growth.samples_us:
        table.add_row(name, *(_spread(growth.exponents(name, least)) for least in (0, LARGE)))
    console.print(table)
    how = "compiled" if is_cold else "from the cache if it is there"
    for kernel in growth.first_call_s[0]:
        calls = ", ".join(f"{call[kernel]:.2g}" for call in growth.first_call_s)
        console.print(f"first {kernel} ({how}), s: {calls}", highlight=False)


def _spread(values: list[float]) -> str:
    if not values:
        return ""
    return f"{median(values):.2f} ({min(values):.2f}..{max(values):.2f})"


def _number(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def draw_growth(growth: Growth, path: Path) -> None:
    """Times over joints, both on logarithmic axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for name in growth.samples_us:
        exponent = growth.exponent(name, LARGE) or growth.exponent(name)
        ours = name.startswith("space_robot")
        label = name if exponent is None else f"{name}: $n^{{{exponent:.2f}}}$"
        axes.loglog(
            growth.joints, growth.medians_us(name), marker="o", markersize=4, label=label,
            linewidth=2.0 if ours else 1.2, linestyle="-" if ours else "--",
        )  # fmt: skip
    axes.set_xlabel("joints")
    axes.set_ylabel("time, us")
    axes.set_xticks(growth.joints, [str(n) for n in growth.joints])
    axes.minorticks_off()
    axes.grid(alpha=0.3, which="both")
    axes.set_title(f"growth with the number of joints (exponents from {LARGE} joints on)")
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=150)
