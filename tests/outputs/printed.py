"""What a chain of commands prints, and what their figures and pages hold, as lines of text."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import pytest
import yaml
from flights import space_robot_here
from matplotlib.figure import Figure
from paths import ROOT

HERE = Path(__file__).parent
CHAINS: dict[str, list[str]] = yaml.safe_load((HERE / "commands.yaml").read_text("utf-8"))
FLOAT = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?|-?\d+e[-+]?\d+")
DIGESTS = re.compile(r"\b(?=[0-9a-f]*[a-f])(?=[a-f]*\d)[0-9a-f]{8,64}\b")
"""Of sources, which may change, and of commits."""
VERSIONS = re.compile(r"\b\d+\.\d+(\.\w+)+\b")
PROGRESS = re.compile(r"\d:\d\d:\d\d|^(kernels|flights) \d|^compiling ")
NOISE = 1e-12
"""Numbers below it are rounding."""
LONGEST = 400
"""Characters of a line that are kept."""


def printed(chain: str, folder: Path) -> list[str]:
    """Run a chain of commands in a folder and return its lines."""
    shutil.copytree(HERE / "files", folder, dirs_exist_ok=True)
    lines: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        patch.setattr(Figure, "savefig", lambda figure, *_, **__: lines.extend(_of(figure)))
        for command in CHAINS[chain]:
            lines.append(f"$ space-robot {command}")
            there = _pages(folder)
            ended = space_robot_here(*shlex.split(command))
            for text in (ended.stdout, ended.stderr):
                lines += _plain(_brief(text), folder)
            lines += [f"exit code {ended.returncode}"] if ended.returncode else []
            for page in sorted(_pages(folder) - there):
                lines += [f"# {page.name}", *_plain(_text_of(page), folder)]
            lines.append("")
    return lines


def _brief(text: str) -> str:
    """Return JSON as a line for each number or text, of lists the first element; others as is."""
    if text[:1] not in ("{", "["):
        return text
    return "\n".join(_leaves("", json.loads(text)))


def _leaves(key: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(f"{key}.{name}" if key else name, inner)
    elif isinstance(value, list) and value:
        yield from _leaves(f"{key}[{len(value)}]", value[0])
    else:
        yield f"{key}: {value}"


def _plain(text: str, folder: Path) -> Iterator[str]:
    """Yield lines without what differs from machine to machine, numbers to five digits."""
    text = VERSIONS.sub("VERSION", text.replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT"))
    for line in text.splitlines():
        if line.strip() and not PROGRESS.search(line) and not DIGESTS.search(line):
            yield FLOAT.sub(_rounded, line).rstrip()[:LONGEST]


def _rounded(number: re.Match[str]) -> str:
    value = float(number[0])
    return "0.0" if abs(value) < NOISE else f"{value:.5g}"


def _of(figure: Any) -> Iterator[str]:
    """Yield what a figure shows: its axes with their labels, lines, marks and areas."""
    for number, axes in enumerate(figure.axes, 1):
        scales = f"{axes.get_xscale()}, {axes.get_yscale()}"
        labels = " | ".join([axes.get_title(), axes.get_xlabel(), axes.get_ylabel()])
        yield f"axes {number}: {' '.join(labels.split())} ({scales})"
        for line in axes.get_lines():
            y = [value for value in map(float, line.get_ydata()) if value == value]
            ends = f", {min(y):.4g} to {max(y):.4g}" if y else ""
            yield f"  line {line.get_label()}: {len(line.get_ydata())} points{ends}"
        drawn = {"collections": axes.collections, "patches": axes.patches, "texts": axes.texts}
        yield f"  {', '.join(f'{len(own)} {name}' for name, own in drawn.items())}"


def _pages(folder: Path) -> set[Path]:
    return {file for file in folder.rglob("*.*") if file.suffix in (".html", ".md")}


def _text_of(page: Path) -> str:
    """Return the words of an HTML page, a line for each of its blocks."""
    text = re.sub(r"(?s)<(script|style|svg|pre).*?</\1>", "", page.read_text("utf-8"))
    text = re.sub(r"</t[hd]>", " | ", text)
    text = re.sub(r"</(tr|p|li|h\d|figcaption|div|dt|dd)>", "\n", text)
    lines = (
        re.sub(r"\s+", " ", line).strip()
        for line in unescape(re.sub(r"<[^>]*>", "", text)).split("\n")
    )
    return "\n".join(filter(None, lines))
