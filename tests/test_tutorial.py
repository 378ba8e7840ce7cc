"""The tutorial's commands print what it shows, in its order, in one folder."""

from __future__ import annotations

import re
import runpy
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from shown import ROOT, differences, run

from space_robot.cli.main import cli

PAGE = (ROOT / "docs/tutorial.md").read_text("utf-8")
LEFT_OUT = "..."


def shown() -> Iterator[tuple[str, list[str]]]:
    """Each command with a prompt, and the lines shown below it."""
    for block in re.findall(r"^```console\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE):
        for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, *lines = part.splitlines()
            yield command, lines


def missing(lines: list[str], printed: str) -> list[str]:
    """The lines that are not printed, one after the other where no dots stand between them."""
    found, at, has_gap = [line.strip() for line in printed.splitlines()], 0, False
    lost = []
    for line in lines:
        if line == LEFT_OUT:
            has_gap = True
            continue
        until = len(found) if has_gap else at + 1
        places = [i for i in range(at, until) if not [*differences([line], found[i : i + 1])]]
        lost += [] if places else [line]
        at, has_gap = (places[0] + 1 if places else at), False
    return lost


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With the examples and the files that the page shows."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for text in re.findall(r"^```(?:python|yaml)\n(# .*?)^```$", PAGE, re.DOTALL | re.MULTILINE):
        file = tmp_path / text.splitlines()[0].removeprefix("# ")
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_the_commands_print_what_is_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow")
    seen = 0
    for line, lines in shown():
        word, *arguments = shlex.split(line.removeprefix("PYTHONPATH=. "))
        if word == "python":
            runpy.run_path(str(folder / arguments[0]))
            printed = capsys.readouterr().out
        elif arguments == ["gains", "check"]:  # ends with 1: the margin is small
            printed = CliRunner(env={"COLUMNS": "80"}).invoke(cli, arguments).stdout
        else:
            assert word == "space-robot"
            printed = run(*arguments)
        lost = missing(lines, printed)
        assert not lost, "\n".join([line, *lost, "", printed])
        seen += 1
    assert seen == 18


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--sensors fine --controller ctc", "after 1.6 s"),
        ("--set plant.echo_scale=[1.02]", "ends after 1.1 s"),
    ],
)
def test_the_flights_that_break_do(options: str, says: str) -> None:
    assert f"    space-robot simulate {options}\n\nends " in PAGE
    assert says in PAGE.split(f"simulate {options}\n")[1][:200]
    ended = CliRunner().invoke(cli, ["simulate", "--json", *options.split()])
    assert ended.exit_code == 1
    (seconds,) = re.findall(r'"ended_at_s": ([\d.]+)', ended.stdout)
    assert f"{float(seconds):.1f} s" in says
