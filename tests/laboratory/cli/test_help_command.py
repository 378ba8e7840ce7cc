"""Help of all kinds: topics, sections, completion in a shell, examples."""

from __future__ import annotations

import re
import shutil
import stat
import sys
from pathlib import Path

import pytest
from click.shell_completion import CompletionItem, ShellComplete
from click.testing import CliRunner
from command import Run, run_program
from pages import TOPICS
from paths import CONFIG, DOCS, ROOT

from space_robot.cli.main import COMMANDS, SECTIONS, cli
from space_robot.cli.shell import ORDER, PROGRAM, VARIABLE, read_topic
from space_robot_control.laws import laws

MOST_LINES, MOST_COLUMNS = 25, 100


def anchors(page: str) -> set[str]:
    """Of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", (ROOT / page).read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_every_file_is_listed(space_robot: Run) -> None:
    assert sorted(ORDER) == [file.stem for file in TOPICS]
    code, out, _ = space_robot("help")
    assert code == 0
    for name in ORDER:
        assert re.search(rf"^{name} +{re.escape(read_topic(name)[0])}$", out, re.MULTILINE)


@pytest.mark.parametrize("name", ORDER)
def test_a_topic_fits_a_screen_and_leads_on(name: str, space_robot: Run) -> None:
    """Its commands are run by test_pages.py."""
    code, out, err = space_robot("help", name)
    assert (code, err) == (0, "")
    lines = out.rstrip("\n").split("\n")
    assert lines[0] == read_topic(name)[0]
    assert lines[0].endswith("?")
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= MOST_COLUMNS
    assert "```" not in out
    pages = re.findall(r"docs/[\w/.#-]+", lines[-1])
    assert lines[-1].startswith("More: ")
    assert pages
    for page, _, anchor in (page.partition("#") for page in pages):
        assert (ROOT / page).is_file()
        assert not anchor or anchor in anchors(page)


def test_a_command_for_a_topic_shows_its_help(space_robot: Run) -> None:
    """Unless a topic has its name."""
    shown = space_robot("help", "simulate").out
    assert shown.startswith("Usage: space-robot simulate [OPTIONS]")
    assert shown == space_robot("simulate", "--help").out
    assert {"gains", "campaign"} <= {*ORDER} & {*COMMANDS}
    assert space_robot("help", "gains").out.startswith(read_topic("gains")[0])


def test_every_command_is_listed_once_below_its_heading() -> None:
    printed = CliRunner().invoke(cli, ["--help"]).output
    of_headings = dict(re.findall(r"^(\S[^\n]*):\n((?:  [^\n]*\n)+)", printed, re.MULTILINE))
    for heading, names in SECTIONS.items():
        assert tuple(re.findall(r"^  (\w+) ", of_headings[heading], re.M)) == names


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
    assert values("") == sorted(COMMANDS)
    assert values("campaign", "re") == ["report", "rerun"]


@pytest.mark.parametrize(
    "option", ["case", "robot", "plant-robot", "sensors", "actuators", "orbit", "mission"]
)
def test_an_option_offers_the_names_of_its_files(option: str) -> None:
    folder = CONFIG / f"{option.removeprefix('plant-').removesuffix('s')}s"
    names = sorted(file.stem for file in folder.glob("*.yaml"))
    assert names
    assert values("simulate", f"--{option}", "") == names
    assert values("simulate", f"--{option}", names[0][:1])[0] == names[0]


def test_laws_gain_sets_choices_and_arguments_are_offered() -> None:
    assert set(values("fly", "--controller", "")) == set(laws())
    assert values("gains", "check", "--controller", "al") == ["all"]
    assert {"default", "printed", "robust", "tuned"} < set(values("simulate", "--gains", ""))
    assert values("simulate", "--navigation", "") == ["direct", "filtered"]
    for words in (["robot"], ["urdf"], ["new"]):
        assert values(*words, "pap") == ["paper"]
    assert values("plan", "lin") == ["line"]
    assert "sensor_grades" in values("campaign", "run", "sensor")


@pytest.mark.parametrize(
    "words",
    ["simulate --robot mine/", "simulate --scenario ", "campaign run my.y", "view flights/"],
)
def test_files_are_offered_where_no_name_fits(words: str) -> None:
    assert [item.type for item in completed(*words.split(" "))] == ["file"]


@pytest.mark.parametrize("words", [("--fault", "list"), ("--scenario", "missing.yaml")])
def test_a_completion_prints_nothing_else_and_never_fails(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert values("simulate", *words, "--navigation", "d") == ["direct"]
    assert capsys.readouterr() == ("", "")


def test_bash_completes(space_robot: Run, tmp_path: Path) -> None:
    bash = shutil.which("bash") or pytest.skip("no bash")
    command = tmp_path / PROGRAM
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m space_robot.cli.main "$@"\n')
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    script = space_robot("completion", "bash").out
    words = 'COMP_WORDS=(space-robot simulate --case 4); COMP_CWORD=3; _space_robot_completion "$0"'
    lines = f'{script}\n{words}\necho "${{COMPREPLY[@]}}"'
    done = run_program([bash, "-c", lines, str(command)], timeout=60)
    assert done.stdout == "4-1 4-2\n", done.stderr


EXAMPLES = ROOT / "examples"


def test_every_program_is_listed_with_its_topic(space_robot: Run) -> None:
    lines = space_robot("examples").out.splitlines()
    programs = sorted(file.stem for file in EXAMPLES.glob("*.py"))
    assert [line.split()[0] for line in lines[: len(programs)]] == programs
    assert all(re.match(r"\w+ +[A-Z].*[.:]", line) for line in lines[: len(programs)])


def test_a_copy_has_the_examples_the_configuration_and_what_the_docs_name(
    space_robot: Run, tmp_path: Path
) -> None:
    """So the commands of the pages work there, without a clone."""
    copied = tmp_path / "deep/trials"
    assert space_robot("examples", "copy", copied).code == 0
    for file in CONFIG.rglob("*.*"):
        assert (copied / file.relative_to(ROOT)).read_bytes() == file.read_bytes()
    names = {file.name for file in (copied / "examples").iterdir()}
    assert {"README.md", "two_link_arm.urdf", "flight_computer"} <= names
    assert {file.name for file in EXAMPLES.glob("*.py")} <= names
    made = {"flight_code", "__pycache__", "flight_computer"}  # by running them
    assert made & {f.name for f in (copied / "examples/flight_computer").iterdir()} == set()
    text = "\n".join(page.read_text("utf-8") for page in sorted(DOCS.rglob("*.md")))
    commands = re.findall(r"^(?: {4,}|\$ )(?!git|tests).*", text, re.MULTILINE)
    named = {p for line in commands for p in re.findall(r"(?:config|examples)/[\w/.]+\w", line)}
    assert {"config/robots/paper.yaml", "examples/two_link_arm.urdf"} <= named
    assert [path for path in sorted(named) if not (copied / path).exists()] == []
