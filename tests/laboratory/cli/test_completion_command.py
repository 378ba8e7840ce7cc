"""Completion in a shell: what is offered where, and a script that bash itself can use."""

from __future__ import annotations

import shutil
import stat
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import CompletionItem, ShellComplete
from command import Run
from paths import CONFIG

from space_robot.cli.completion import PROGRAM, VARIABLE
from space_robot.cli.main import cli
from space_robot_control.laws import laws


def completed(*words: str) -> list[CompletionItem]:
    """What is offered for the last word."""
    *before, last = words
    shell: ShellComplete = ShellComplete(cli, {}, PROGRAM, VARIABLE)
    return shell.get_completions(before, last)


def values(*words: str) -> list[str]:
    items = completed(*words)
    assert all(item.type == "plain" for item in items)
    return [str(item.value) for item in items]


def test_every_command_is_offered() -> None:
    assert values("") == [name for name in sorted(cli.commands) if not cli.commands[name].hidden]
    assert values("campaign", "re") == ["report", "rerun"]


@pytest.mark.parametrize(
    ("option", "folder"),
    [
        ("--case", "cases"),
        ("--robot", "robots"),
        ("--plant-robot", "robots"),
        ("--sensors", "sensors"),
        ("--actuators", "actuators"),
        ("--orbit", "orbits"),
        ("--mission", "missions"),
    ],
)
def test_an_option_offers_the_names_of_its_files(option: str, folder: str) -> None:
    names = sorted(file.stem for file in (CONFIG / folder).glob("*.yaml"))
    assert names
    assert values("simulate", option, "") == names
    assert values("simulate", option, names[0][:1])[0] == names[0]


def test_laws_gain_sets_and_choices_are_offered() -> None:
    assert set(values("fly", "--controller", "")) == set(laws())
    assert values("gains", "check", "--controller", "al") == ["all"]
    assert {"default", "printed", "robust", "tuned"} < set(values("simulate", "--gains", ""))
    assert values("simulate", "--navigation", "") == ["direct", "filtered"]


def test_arguments_offer_the_names_of_their_files() -> None:
    for words in (["robot"], ["urdf"], ["new"]):
        assert values(*words, "pap") == ["paper"]
    assert values("plan", "lin") == ["line"]
    assert "sensor_grades" in values("campaign", "run", "sensor")


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "--robot", "mine/"),
        ("simulate", "--scenario", ""),
        ("campaign", "run", "my.y"),
        ("view", "flights/"),
    ],
)
def test_files_are_offered_where_no_name_fits(words: tuple[str, ...]) -> None:
    assert [item.type for item in completed(*words)] == ["file"]


@pytest.mark.parametrize("words", [("--fault", "list"), ("--scenario", "missing.yaml")])
def test_a_completion_prints_nothing_else_and_never_fails(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert values("simulate", *words, "--navigation", "d") == ["direct"]
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_asks_the_command_by_the_variable_that_click_reads(
    space_robot: Run, shell: str
) -> None:
    ran = space_robot("completion", shell)
    assert ran.code == 0
    assert f"{VARIABLE}={shell}_complete" in ran.out
    assert space_robot("completion", "csh").code == 2


def test_bash_completes(space_robot: Run, tmp_path: Path) -> None:
    bash = shutil.which("bash") or pytest.skip("no bash")
    command = tmp_path / PROGRAM
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m space_robot.cli.main "$@"\n')
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    script = space_robot("completion", "bash").out
    words = 'COMP_WORDS=(space-robot simulate --case 4); COMP_CWORD=3; _space_robot_completion "$0"'
    done = subprocess.run(
        [bash, "-c", f'{script}\n{words}\necho "${{COMPREPLY[@]}}"', str(command)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == "4-1 4-2\n", done.stderr


def test_a_completion_imports_nothing_slow() -> None:
    slow = {"numpy", "numba", "pydantic", "yaml", "scipy"}
    code = (
        "import sys; from click.shell_completion import ShellComplete as S\n"
        "from space_robot.cli.main import cli\n"
        f"S(cli, {{}}, {PROGRAM!r}, {VARIABLE!r}).get_completions(['simulate', '--robot'], '')\n"
        f"print(sorted({slow!r} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "[]\n", done.stderr


def test_the_variable_is_the_one_that_click_makes_of_the_program() -> None:
    name = PROGRAM.replace("-", "_").upper()
    assert f"_{name}_COMPLETE" == VARIABLE
    assert isinstance(cli, click.Group)
