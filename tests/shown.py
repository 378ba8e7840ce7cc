"""What a document shows of a command's output, compared with what the command prints."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

from click.testing import CliRunner

from space_robot.cli.main import cli

ROOT = Path(__file__).resolve().parents[1]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")


def run(*arguments: str, columns: int = 80) -> str:
    """What ``space-robot`` prints on standard output, on a terminal of so many columns.

    Raises:
        AssertionError: its exit code is not 0.
    """
    result = CliRunner(env={"COLUMNS": str(columns)}).invoke(cli, arguments)
    assert result.exit_code == 0, (result.output, result.exception)
    return result.stdout


def block(document: str, first: str, last: str) -> list[str]:
    """Lines of a document's indented block, from one that holds ``first`` to one with ``last``."""
    lines = (ROOT / document).read_text("utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if first in line)
    stop = next(i for i, line in enumerate(lines[start:], start) if last in line)
    return [line.strip() for line in lines[start : stop + 1]]


def step(number: str) -> float:
    """One in the last place that is shown."""
    digits, _, exponent = number.partition("e")
    return float(10.0 ** (int(exponent or 0) - len(digits.partition(".")[2])))


def differences(shown: Sequence[str], printed: Sequence[str]) -> Iterator[str]:
    """Where two texts differ: in words, or by more than one in the last place shown.

    The last place may differ: what is shown is rounded, and where libraries compute (gains,
    proofs) their last bits are the processor's. Widths of columns do not count.
    """
    for ours, theirs in zip_longest(shown, printed, fillvalue=""):
        numbers = [NUMBER.findall(line) for line in (ours, theirs)]
        words = [
            re.sub(r"([━─])\1*|\s+", r"\1 ", NUMBER.sub("#", t)).split() for t in (ours, theirs)
        ]
        if words[0] != words[1] or any(
            abs(float(a) - float(b)) > 1.01 * max(step(a), step(b))
            for a, b in zip(*numbers, strict=True)
        ):
            yield f"shown:   {ours}\nprinted: {theirs}"


def check(shown: Sequence[str], printed: str, first: str = "") -> None:
    """The shown lines are the printed ones from the line that holds ``first`` on.

    Raises:
        AssertionError: they are not; the document shows what the command printed once.
    """
    lines = [line.strip() for line in printed.splitlines()]
    start = next(i for i, line in enumerate(lines) if first in line)
    found = list(differences(shown, lines[start : start + len(shown)]))
    assert not found, "\n".join(found)
