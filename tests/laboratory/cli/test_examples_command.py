"""The example programs and the shipped configuration, for users who have no clone."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from command import Run
from paths import CONFIG, DOCS, ROOT

EXAMPLES = ROOT / "examples"


def test_every_program_is_listed_with_its_topic(space_robot: Run) -> None:
    lines = space_robot("examples").out.splitlines()
    programs = sorted(file.stem for file in EXAMPLES.glob("*.py"))
    assert [line.split()[0] for line in lines[: len(programs)]] == programs
    assert all(re.match(r"\w+ +[A-Z].*[.:]", line) for line in lines[: len(programs)])


@pytest.fixture
def copied(space_robot: Run, tmp_path: Path) -> Path:
    assert space_robot("examples", "copy", tmp_path / "deep/trials").code == 0
    return tmp_path / "deep/trials"


def test_a_copy_has_every_example_and_the_whole_configuration(copied: Path) -> None:
    for file in CONFIG.rglob("*.*"):
        assert (copied / file.relative_to(ROOT)).read_bytes() == file.read_bytes()
    names = {file.name for file in (copied / "examples").iterdir()}
    assert {"README.md", "two_link_arm.urdf", "flight_computer"} <= names
    assert {file.name for file in EXAMPLES.glob("*.py")} <= names
    made = {"flight_code", "__pycache__", "flight_computer"}  # by running them
    assert made & {f.name for f in (copied / "examples/flight_computer").iterdir()} == set()


def test_nothing_is_overwritten(space_robot: Run, tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    ran = space_robot("examples", "copy", tmp_path)
    assert ran.code == 2
    assert ran.err == (
        f"space-robot: error: {tmp_path / 'config'}: exists already; it is not overwritten\n"
    )
    assert os.listdir(tmp_path) == ["config"]


def test_the_files_that_commands_of_the_docs_name_are_in_the_copy(copied: Path) -> None:
    """So the pages' commands work there, without a clone."""
    text = "\n".join(page.read_text("utf-8") for page in sorted(DOCS.rglob("*.md")))
    commands = re.findall(r"^(?: {4,}|\$ )(?!git|tests).*", text, re.MULTILINE)
    named = {p for line in commands for p in re.findall(r"(?:config|examples)/[\w/.]+\w", line)}
    assert {"config/robots/paper.yaml", "examples/two_link_arm.urdf"} <= named
    assert [path for path in sorted(named) if not (copied / path).exists()] == []
