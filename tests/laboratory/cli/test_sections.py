"""The help of ``space-robot`` lists every command once, below a heading, with a whole sentence."""

from __future__ import annotations

import re

from click.testing import CliRunner

from space_robot.cli.main import cli
from space_robot.cli.sections import SECTIONS, section_of


def test_every_command_is_listed_once_below_its_heading() -> None:
    printed = CliRunner().invoke(cli, ["--help"]).output
    of_headings = dict(re.findall(r"^(\S[^\n]*):\n((?:  [^\n]*\n)+)", printed, re.MULTILINE))
    for name, command in cli.commands.items():
        headings = [h for h in SECTIONS if re.search(rf"^  {name} ", of_headings.get(h, ""), re.M)]
        assert headings == ([] if command.hidden else [section_of(command)]), name


def test_no_sentence_is_cut() -> None:
    assert "..." not in CliRunner().invoke(cli, ["--help"]).output.partition("Options:")[2]
