"""The programs of examples/ run as they say, and print what stands at their top."""

from __future__ import annotations

import ast
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from flights import ros_environment
from shown import ROOT, differences

EXAMPLES = ROOT / "examples"
PROGRAMS = sorted(EXAMPLES.glob("*.py"))
ON_THE_GRAPH = {"fault", "replay_regression", "swap_in_flight"}
NEEDS = {"pandas_analysis": "pandas", "small_campaign": "pyarrow"}


def blocks(program: Path) -> list[list[str]]:
    """The indented blocks of a program's docstring: its command, and what that prints."""
    docstring = ast.get_docstring(ast.parse(program.read_text("utf-8"))) or ""
    paragraphs = [text.splitlines() for text in docstring.split("\n\n")]
    return [lines for lines in paragraphs if all(line.startswith("    ") for line in lines)]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_an_example_prints_what_it_shows(program: Path, tmp_path: Path) -> None:
    if module := NEEDS.get(program.stem):
        pytest.importorskip(module)
    if program.stem in ON_THE_GRAPH:
        pytest.importorskip("rclpy")
    (command,), shown = blocks(program)
    python, name, *arguments = shlex.split(command)
    assert (python, ROOT / name) == ("python", program)
    scripts = Path(sys.executable).parent
    environment = {
        **ros_environment(),
        "PATH": os.pathsep.join((str(scripts), os.environ.get("PATH", ""))),
        "PYTHONPATH": os.pathsep.join((str(ROOT), os.environ.get("PYTHONPATH", ""))),
    }
    done = subprocess.run(
        [sys.executable, str(program), *arguments],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = list(differences([line.strip() for line in shown], done.stdout.splitlines()))
    assert not found, "\n".join(found)
    for option, value in zip(arguments[::2], arguments[1::2], strict=True):
        assert option == "--out"
        assert (tmp_path / value).with_suffix(".png").stat().st_size > 10_000


def test_each_example_stands_in_the_table() -> None:
    table = (EXAMPLES / "README.md").read_text("utf-8")
    for program in PROGRAMS:
        assert f"[{program.stem}]({program.name}) |" in table
        assert 25 <= len(program.read_text("utf-8").splitlines()) <= 80
    assert len(PROGRAMS) == 10
