"""Makes the picture of `explanation/lanes.md` from reports of the benchmark.

make bench ARGS='lanes --output avx2.json'
NUMBA_CPU_NAME=x86-64 make bench ARGS='lanes --output sse2.json'
python docs/lanes_picture.py docs/explanation/lanes.png AVX2=avx2.json SSE2=sse2.json
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

FLIGHT = "flight of 5 s of a campaign, "


def rates(report: Path) -> dict[str, dict[str, list[float]]]:
    """Return the flights in a second of each repetition, by cores and way of flying."""
    sections: dict[str, Any] = json.loads(report.read_text())["sections"]
    found = {}
    for result in sections["lanes"]:
        if result["name"].startswith(FLIGHT):
            names = {"this": "eight together"}
            found[result["name"].removeprefix(FLIGHT)] = {
                names.get(name, name): [1e3 / ms for ms in samples]
                for name, samples in result["samples"].items()
            }
    return found


def draw(picture: Path, reports: dict[str, Path]) -> None:
    """Draw a bar for each way of flying, grouped by cores, with the spread of the repetitions."""
    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    bars = [
        (f"{how}, {vectors}", cores, values)
        for vectors, report in reports.items()
        for cores, ways in rates(report).items()
        for how, values in sorted(ways.items(), reverse=True)
    ]
    labels, groups = (list(dict.fromkeys(bar[k] for bar in bars)) for k in (0, 1))
    width = 0.8 / len(labels)
    for label, cores, values in bars:
        place = groups.index(cores) + width * (labels.index(label) - 0.5 * (len(labels) - 1))
        middle = float(np.median(values))
        axes.bar(
            place,
            middle,
            0.92 * width,
            yerr=[[middle - min(values)], [max(values) - middle]],
            color=f"C{labels.index(label)}",
            label=label if cores == groups[0] else None,
            capsize=3,
        )
    axes.set_xticks(range(len(groups)), groups)
    axes.set_ylabel("flights of 5 s in a second")
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(picture, dpi=150)


if __name__ == "__main__":
    named = dict(argument.split("=", 1) for argument in sys.argv[2:])
    draw(Path(sys.argv[1]), {name: Path(report) for name, report in named.items()})
