"""The programs of examples/ run as they say, and print what stands at their top."""

from __future__ import annotations

import ast
import os
import shlex
import sys
from pathlib import Path

import pytest
from flights import ros_environment
from forked import Forked
from shown import ROOT, differences

pytest.importorskip("rclpy")  # of some of them, and of the server that they are forked from
EXAMPLES = ROOT / "examples"
PROGRAMS = sorted(EXAMPLES.glob("*.py"))
NEEDS = {"mpc_law": "daqp", "pandas_analysis": "pandas", "small_campaign": "pyarrow"}


def blocks(program: Path) -> list[list[str]]:
    """The indented blocks of a program's docstring: its command, and what that prints."""
    docstring = ast.get_docstring(ast.parse(program.read_text("utf-8"))) or ""
    paragraphs = [text.splitlines() for text in docstring.split("\n\n")]
    return [lines for lines in paragraphs if all(line.startswith("    ") for line in lines)]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_an_example_prints_what_it_shows(program: Path, tmp_path: Path) -> None:
    """In a process forked from a loaded one: most of its time would be that of its imports."""
    if module := NEEDS.get(program.stem):
        pytest.importorskip(module)
    (*others, command), shown = blocks(program)
    *domain, python, name = shlex.split(command)[: command.split().index("python") + 2]
    arguments = shlex.split(command)[len(domain) + 2 :]
    assert (python, ROOT / name) == ("python", program)
    scripts = Path(sys.executable).parent
    environment = {
        **ros_environment(),
        "PATH": os.pathsep.join((str(scripts), os.environ.get("PATH", ""))),
        "PYTHONPATH": os.pathsep.join((str(ROOT), os.environ.get("PYTHONPATH", ""))),
    }
    in_other_terminals = [
        Forked.of_command(shlex.split(other), environment, tmp_path) for other in others
    ]
    environment |= dict(word.split("=") for word in domain)
    process = Forked.of_command([str(program), *arguments], environment, tmp_path)
    output, errors = process.communicate(timeout=200)
    assert process.returncode == 0, errors
    for other in in_other_terminals:
        _, errors = other.communicate(timeout=60)
        assert other.returncode == 0, errors
    found = list(differences([line.strip() for line in shown], output.splitlines()))
    assert not found, "\n".join(found)
    for option, value in zip(arguments[::2], arguments[1::2], strict=True):
        assert option == "--out"
        assert (tmp_path / value).with_suffix(".png").stat().st_size > 10_000


def test_each_example_stands_in_the_table() -> None:
    table = (EXAMPLES / "README.md").read_text("utf-8")
    for program in PROGRAMS:
        assert f"[{program.stem}]({program.name}) |" in table
        assert 25 <= len(program.read_text("utf-8").splitlines()) <= 100
    assert len(PROGRAMS) == 18
