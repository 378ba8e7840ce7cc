"""Examples, notebooks, the tutorial and the Python of the manual print what they show."""

from __future__ import annotations

import ast
import os
import re
import runpy
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from flights import ros_environment
from forked import Forked
from paths import DOCS, ROOT
from shown import differences, run

from space_robot.cli.main import cli

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")

pytestmark = pytest.mark.docs
EXAMPLES = ROOT / "examples"
PROGRAMS = sorted(EXAMPLES.glob("*.py"))
NEEDS = {"mpc_law": "daqp", "pandas_analysis": "pandas", "small_campaign": "pyarrow"}
TUTORIAL = (DOCS / "tutorial.md").read_text("utf-8")
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
PYTHON = re.compile(r"```python( gym)?\n(.*?)```", re.DOTALL)


@pytest.mark.ros
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_an_example_prints_what_stands_at_its_top(program: Path, tmp_path: Path) -> None:
    """In a process forked from a loaded one: most of its time would be that of its imports."""
    pytest.importorskip("rclpy")
    if module := NEEDS.get(program.stem):
        pytest.importorskip(module)
    docstring = ast.get_docstring(ast.parse(program.read_text("utf-8"))) or ""
    paragraphs = [text.splitlines() for text in docstring.split("\n\n")]
    blocks = [lines for lines in paragraphs if all(line.startswith("    ") for line in lines)]
    (*others, command), shown = blocks
    *domain, python, name = shlex.split(command)[: command.split().index("python") + 2]
    arguments = shlex.split(command)[len(domain) + 2 :]
    assert (python, ROOT / name) == ("python", program)
    environment = {
        **ros_environment(),
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", ""))),
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
    lost = list(differences([line.strip() for line in shown], output.splitlines()))
    assert not lost, "\n".join(lost)
    for option, value in zip(arguments[::2], arguments[1::2], strict=True):
        assert option == "--out"
        assert (tmp_path / value).with_suffix(".png").stat().st_size > 10_000


def test_each_example_stands_in_the_table() -> None:
    table = (EXAMPLES / "README.md").read_text("utf-8")
    for program in PROGRAMS:
        assert f"[{program.stem}]({program.name}) |" in table
        assert 25 <= len(program.read_text("utf-8").splitlines()) <= 100


def cell_texts(notebook: Any) -> Iterator[tuple[int, str]]:
    """What each cell prints, and shows as text; of a picture, that it is one."""
    for number, cell in enumerate(notebook.cells):
        outputs = cell.get("outputs", ())
        streams = [output for output in outputs if output.output_type == "stream"]
        assert all(stream.name == "stdout" for stream in streams), streams
        if streams:  # in how many messages is a matter of time
            yield number, "".join(stream.text for stream in streams)
        for output in outputs:
            if output.output_type != "stream":
                is_picture = "image/png" in output.data
                yield number, "a picture" if is_picture else output.data["text/plain"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_what_it_shows(path: Path) -> None:
    executed = runpy.run_path(str(path.with_name("execute.py")))["executed"]
    shown, now = ([*cell_texts(book)] for book in (nbformat.read(path, 4), executed(path)))
    assert sum(text == "a picture" for _, text in now) >= 4
    assert [number for number, _ in shown] == [number for number, _ in now]
    for (number, ours), (_, theirs) in zip(shown, now, strict=True):
        lost = [*differences(ours.splitlines(), theirs.splitlines())]
        assert not lost, f"cell {number}:\n" + "\n".join(lost)


def missing(lines: list[str], printed: str) -> list[str]:
    """The lines that are not printed, one after the other where no dots stand between them."""
    output, at, has_gap, lost = [line.strip() for line in printed.splitlines()], 0, False, []
    for line in lines:
        if line == "...":
            has_gap = True
            continue
        until = len(output) if has_gap else at + 1
        places = [i for i in range(at, until) if not [*differences([line], output[i : i + 1])]]
        lost += [] if places else [line]
        at, has_gap = (places[0] + 1 if places else at), False
    return lost


def test_the_tutorial_prints_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its commands in their order, in one folder with the examples and the files that it shows."""
    pytest.importorskip("pyarrow")
    (tmp_path / "examples").symlink_to(EXAMPLES)
    for text in re.findall(r"^```(?:python|yaml)\n(# .*?)^```$", TUTORIAL, re.DOTALL | re.M):
        file = tmp_path / text.splitlines()[0].removeprefix("# ")
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    consoles = re.findall(r"^```console\n(.*?)^```$", TUTORIAL, re.DOTALL | re.MULTILINE)
    parts = [part for text in consoles for part in re.split(r"^\$ ", text, flags=re.M)[1:]]
    assert len(parts) >= 18
    for line, *lines in map(str.splitlines, parts):
        word, *arguments = shlex.split(line.removeprefix("PYTHONPATH=. "))
        if word == "python":
            runpy.run_path(str(tmp_path / arguments[0]))
            printed = capsys.readouterr().out
        elif arguments == ["gains", "check"]:  # ends with 1: the margin is small
            printed = CliRunner(env={"COLUMNS": "80"}).invoke(cli, arguments).stdout
        else:
            printed = run(*arguments)
        lost = missing(lines, printed)
        assert not lost, "\n".join([line, *lost, "", printed])


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--sensors fine --controller ctc", "after 1.6 s"),
        ("--set plant.echo_scale=[1.02]", "ends after 1.1 s"),
    ],
)
def test_the_flights_that_break_do(options: str, says: str) -> None:
    assert f"    space-robot simulate {options}\n\nends " in TUTORIAL
    assert says in TUTORIAL.split(f"simulate {options}\n")[1][:200]
    ended = CliRunner().invoke(cli, ["simulate", "--json", *options.split()])
    assert ended.exit_code == 1
    (seconds,) = re.findall(r'"ended_at_s": ([\d.]+)', ended.stdout)
    assert f"{float(seconds):.1f} s" in says


@pytest.fixture(scope="module")
def manual() -> dict[str, Any]:
    """What the Python of docs/manual/python.md has made."""
    names: dict[str, Any] = {}
    text = (DOCS / "manual/python.md").read_text("utf-8")
    blocks = [code for gym, code in PYTHON.findall(text) if not gym]
    assert len(blocks) == 8
    for code in blocks:
        exec(compile(code, "python.md", "exec"), names)
    return names


def test_the_python_manual_runs(manual: dict[str, Any]) -> None:
    bench = manual["bench"]
    assert bench.outcome == "complete"
    assert bench.tick == bench.ticks == 60_000
    error = bench.reference.joint_positions - bench.truth.joint_positions
    assert abs(error).max() < 0.01


def test_the_gymnasium_of_the_python_manual_runs(manual: dict[str, Any]) -> None:
    pytest.importorskip("gymnasium")
    text = (DOCS / "manual/python.md").read_text("utf-8")
    tracking, reach = (code for gym, code in PYTHON.findall(text) if gym)
    names = {"Scenario": manual["Scenario"]}
    exec(compile(tracking, "python.md", "exec"), names)
    assert names["is_over"]
    exec(compile(reach, "python.md", "exec"), names)
    assert names["observations"].shape == (16, 18)


def test_the_python_of_readme_flies_three_laws_and_shows_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser")
    opened: list[str] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda url: bool(opened.append(url)) or True)
    ((_, code),) = PYTHON.findall((ROOT / "README.md").read_text("utf-8"))
    exec(compile(code, "README.md", "exec"), {})
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows[:3]] == ["tde_stc", "ctc", "ctc_smc"]
    assert all(0.0 < float(error) < 1e-2 for row in rows[:3] for error in row[1:])
    assert {"tde_stc.png", "tde_stc.svg"} < {file.name for file in tmp_path.iterdir()}
    assert len(opened) == 1
