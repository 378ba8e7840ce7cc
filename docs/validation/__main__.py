"""Compare the physics and the decisions of this project with independent programs.

Writes docs/validation.json, its tables into docs/validation.md, and the picture of a robot that
tumbles. Exit code 1: a difference is beyond its limit, and nothing is written.
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import sys
import time
from collections.abc import Iterator
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
PAGE, NUMBERS, PICTURE = (DOCS / f"validation.{kind}" for kind in ("md", "json", "svg"))
PACKAGES = "space_robot", "numpy", "numba", "scipy", "pin", "mujoco"
KEPT = "linear momentum", "angular momentum", "energy"
OURS = "space_robot, RK4"
INK, FAINT, LINES = "#010101", "#020202", ("#030303", "#040404", "#050505", "#060606")
"""Colours that matplotlib draws with; `themed` replaces them."""
THEME = {  # in light and in dark
    INK: ("#1f2328", "#e6edf3"),
    FAINT: ("#d1d9e0", "#3d444d"),
    LINES[0]: ("#0072b2", "#56b4e9"),
    LINES[1]: ("#b35900", "#e69f00"),
    LINES[2]: ("#007a5a", "#2fc99b"),
    LINES[3]: ("#b0418a", "#e08cc0"),
}


def measure() -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return all rows, printed one by one, and drifts by integrator."""
    sys.path += [str(DOCS.parent / folder) for folder in ("tests", "tools/benchmarks")]
    import physics
    import software
    from rows import PINOCCHIO, ValidationRow

    drifts = {}

    def conserved() -> Iterator[ValidationRow]:
        for name in ("", *physics.INTEGRATORS):
            drifts[f"MuJoCo, {name}" if name else OURS] = physics.drifts(name)
        extent = f"{physics.DURATION_S:g} s in steps of {1e3 * physics.STEP_S:g} ms"
        drift = float(drifts[OURS][:, 1:].max())
        yield ValidationRow("momenta and energy of a free robot", PINOCCHIO, extent, drift, 1e-9)

    rows = []
    sections = physics.trees, conserved, physics.joints, physics.captures, physics.in_orbit
    for section in (*sections, software.navigation, software.allocation, software.statistics):
        rows += [announced(row) for row in section()]
    rows += [announced(row) for row in software.bits()]
    return rows, {name: column.tolist() for name, column in drifts.items()}


def announced(row: Any) -> dict[str, Any]:
    """Print a row; return it by names."""
    print(f"{' | '.join(cells(row._asdict()))}{'' if row.difference <= row.limit else '  BEYOND'}")
    sys.stdout.flush()
    fields: dict[str, Any] = row._asdict()
    return fields


def cells(row: dict[str, Any]) -> list[str]:
    """Return the texts of a row."""
    return [
        row["check"],
        row["against"],
        row["extent"],
        *map(short, (row["difference"], row["limit"])),
    ]


def short(number: float) -> str:
    """Return a number with two digits, as in 3.1e-9."""
    return f"{number:.2g}".replace("e-0", "e-")


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(row)} |" for row in (head, *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]])


def written(page: str, numbers: dict[str, Any]) -> str:
    """Return the page with the tables of these numbers."""
    head = ["what is compared", "with", "over", "largest difference", "limit"]
    drifts = [
        [name, *(short(max(column)) for column in list(zip(*rows, strict=True))[1:])]
        for name, rows in numbers["drifts"].items()
    ]
    made = ", ".join(f"{name} {text}" for name, text in numbers["versions"].items())
    parts = {
        "rows": table(head, [cells(row) for row in numbers["rows"]]),
        "drifts": table(["", *KEPT], drifts),
        "made": f"Made on {numbers['date']} in {numbers['seconds']} s: {made}.",
    }
    for name, part in parts.items():
        place = re.compile(rf"(<!-- begin {name} -->\n\n).*?(\n\n<!-- end -->)", re.S)
        page = place.sub(lambda found, part=part: f"{found[1]}{part}{found[2]}", page)
    return page


def draw(drifts: dict[str, Any]) -> None:
    """Draw the drift of angular momentum over time."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    style = {"svg.fonttype": "none", "svg.hashsalt": "validation", "font.size": 12}
    names = "text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"
    with mpl.rc_context({**style, **dict.fromkeys(names, INK), "font.family": "sans-serif"}):
        figure = Figure(figsize=(6.4, 3.8), layout="constrained")
        axes = figure.subplots()
        shown = [name for name in drifts if "fast" not in name]  # the same line as Euler's
        for name, colour in zip(shown, LINES, strict=True):
            time_s, drift = [row[0] for row in drifts[name]], [row[2] for row in drifts[name]]
            label = f"{name}, implicitfast" if name.endswith("Euler") else name
            axes.semilogy(time_s, drift, color=colour, linewidth=2.0, label=label)
        axes.grid(color=FAINT)
        axes.spines[["top", "right"]].set_visible(False)
        labels = {"xlabel": "time (s)", "ylabel": "drift of angular momentum"}
        axes.set(**labels, xlim=(0, 600), ylim=(1e-15, 1.0))
        axes.legend(frameon=False, loc="center", bbox_to_anchor=(0.5, 0.57))
        figure.savefig(PICTURE, transparent=True, metadata={"Date": None})
    PICTURE.write_text(themed(PICTURE.read_text("utf-8")), "utf-8")


def themed(svg: str) -> str:
    """Return a picture with the colours of `THEME`, by the reader's light or dark scheme."""
    light, dark = (
        ";".join(f"--c{colour[1:]}:{pair[k]}" for colour, pair in THEME.items()) for k in (0, 1)
    )
    rules = f"svg{{{light}}}@media (prefers-color-scheme: dark){{svg{{{dark}}}}}"
    for colour in THEME:
        svg = svg.replace(colour, f"var(--c{colour[1:]})")
    return svg.replace("<defs>", f"<style>{rules}</style>\n <defs>", 1)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="make validation", description=__doc__)
    parser.parse_args()
    begun = time.monotonic()
    rows, drifts = measure()
    if any(not row["difference"] <= row["limit"] for row in rows):
        sys.exit("beyond its limit: see above")
    versions = {"Python": platform.python_version(), **{name: version(name) for name in PACKAGES}}
    seconds = round(time.monotonic() - begun)
    made = {"date": f"{date.today()}", "seconds": seconds, "versions": versions}
    numbers = {**made, "rows": rows, "drifts": drifts}
    NUMBERS.write_text(f"{json.dumps(numbers, indent=1)}\n", "utf-8")
    PAGE.write_text(written(PAGE.read_text("utf-8"), numbers), "utf-8")
    draw(drifts)


if __name__ == "__main__":
    main()
