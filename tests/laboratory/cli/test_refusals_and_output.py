"""Typing errors, wrong files, output that cannot be written: one line, an exit code."""

from __future__ import annotations

import copy
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml
from command import Run
from flights import simulated
from flights import space_robot as started
from paths import CONFIG, DATA
from robots import driven_paper

from space_robot.console.files import ABANDONED_S, atomic_file, atomic_folder
from space_robot_model.robot.parts import MOST_PLATES
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment import surfaces
from space_robot_sim.plant.mounting import MOST_SUBSTEPS
from space_robot_sim.plant.settings import PlantSettings

TABLE = DATA / "refusals/commands.yaml"
URDF = (DATA / "docs.urdf").read_text("utf-8")
PAPER = (CONFIG / "robots/paper.yaml").read_text("utf-8")

MADE = {
    "my.urdf": URDF,
    "no_mass.urdf": URDF.replace('<mass value="10"/>', '<mass value="-10"/>'),
    "no_link.urdf": URDF.replace('<parent link="upper_arm"/>', '<parent link="uper_arm"/>'),
    "no_end.urdf": URDF.replace("</robot>", ""),
    "kg.yaml": re.sub(r"mass: ([\d.]+)", r"mass: \1 kg", PAPER, count=1),
    "arm.urdf": (DATA / "arm.urdf").read_text("utf-8"),
    "ets.yaml": (CONFIG / "robots/ets_vii.yaml").read_text("utf-8"),
    "paper.yaml": yaml.safe_dump(driven_paper()),
}
"""Files that are no lines of a table."""


class Group(NamedTuple):
    """Rows of a table: the words typed, or what is in the file, and what is said."""

    rows: list[list[Any]]
    files: dict[str, str]
    command: str = ""
    made: tuple[str, ...] = ()
    file: str = ""
    """Whose content is that of the row, or of ``base`` with the row's values by key."""
    base: Any = None
    at: str = ""


GROUPS = {
    name: Group(**{"files": {}, **content})
    for name, content in yaml.safe_load(TABLE.read_text("utf-8")).items()
}

ROWS = [(name, k) for name, group in GROUPS.items() for k in range(len(group.rows))]


def put(tree: Any, key: str, value: Any) -> None:
    *parents, last = key.split(".")
    for part in parents:
        tree = tree[int(part)] if isinstance(tree, list) else tree.setdefault(part, {})
    tree[int(last) if isinstance(tree, list) else last] = value


def content_of(group: Group, given: Any) -> str:
    """The text of the row's file."""
    if isinstance(given, str):
        return given
    base = yaml.safe_load(PAPER) if group.base == "paper" else copy.deepcopy(group.base or {})
    for key, value in {group.at: given}.items() if group.at else given.items():
        put(base, key, value)
    return yaml.safe_dump(base)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "bag"
    simulated(path, controller="ctc", duration=0.3)
    return path


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def make(group: Group, folder: Path, bag: Path) -> None:
    for name, text in {**{name: MADE.get(name) for name in group.made}, **group.files}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if text is None:
            (folder / name).symlink_to(bag)
        else:
            (folder / name).write_text(text, "utf-8")


def said_is(line: str, said: str) -> bool:
    """Whether a line is what is expected, but for its dots."""
    pattern = ".*".join(map(re.escape, said.split("...")))
    return re.fullmatch(f"space-robot: error: {pattern}", line) is not None


@pytest.mark.parametrize(("name", "k"), ROWS)
def test_what_is_said(name: str, k: int, here: Path, bag: Path, space_robot: Run) -> None:
    group = GROUPS[name]
    *given, said = group.rows[k]
    make(group, here, bag)
    typed = group.command
    if group.file:
        (here / group.file).write_text(content_of(group, given[0]), "utf-8")
    else:
        typed = f"{typed} {given[0]}".replace("LONG", 300 * "a")
    before = sorted(here.rglob("*"))
    code, out, err = space_robot(*shlex.split(typed))
    (line,) = err.splitlines()
    assert said_is(line, said), line
    assert (code, out) == (2, "")
    assert sorted(here.rglob("*")) == before


def test_a_process_of_its_own_says_the_same(here: Path, bag: Path) -> None:
    group = GROUPS["typing_errors"]
    typed, said = group.rows[0]
    make(group, here, bag)
    ended = started(*shlex.split(typed))
    (line,) = ended.stderr.splitlines()
    assert said_is(line, said), line
    assert (ended.returncode, ended.stdout) == (2, "")


DRIVE = {"rotor_inertia": 1e-4, "gear_ratio": 100.0, "stiffness": 1e9}


def test_the_steps_that_an_error_names_would_do(here: Path, space_robot: Run) -> None:
    """So does the period; one substep less would not."""
    content = yaml.safe_load(PAPER)
    content["robot"]["links"][1]["drive"] = DRIVE
    (here / "paper.yaml").write_text(yaml.safe_dump(content))
    words = ("simulate", "--robot", "paper.yaml", "--duration", "0.001")
    said = space_robot(*words).err
    assert "drive.stiffness of 'joint2' is too large for steps of 0.0005 s: " in said
    advice = said.partition("; substeps: ")[2].split()
    substeps, period = int(advice[0]), float(advice[5])
    assert space_robot(*words, "--set", f"plant.substeps={substeps - 1}").code == 2
    for better in (["--set", f"plant.substeps={substeps}"], ["--period", str(period)]):
        assert space_robot(*words, *better).code == 0


def test_limits_are_those_of_the_plant() -> None:
    assert MOST_PLATES == surfaces.MOST_PLATES
    bounds = PlantSettings.model_fields["substeps"].metadata
    assert {MOST_SUBSTEPS} == {bound.le for bound in bounds if hasattr(bound, "le")}


def test_a_pipe_for_a_file_is_not_waited_for(here: Path, space_robot: Run) -> None:
    os.mkfifo(here / "pipe.yaml")
    for option in ("--robot", "--mission", "--case", "--gains", "--scenario"):
        ran = space_robot("simulate", option, "pipe.yaml")
        assert (ran.code, "not a file" in ran.err) == (2, True), option


def test_a_reader_that_has_gone_is_no_error_to_tell(bag: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        result = subprocess.run(
            [sys.executable, "-m", "space_robot.cli.main", "analyze", str(bag), "--json"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (result.returncode, result.stderr) == (1, "")


def test_an_older_file_stays_whole_if_the_new_one_fails(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("older")

    def fail() -> None:
        with atomic_file(path, replace=True) as file:
            file.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="cannot be written"):
        fail()
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]
    with atomic_file(path, replace=True) as f:
        f.write(b"newer")
    assert path.read_text() == "newer"


def test_a_flight_that_diverges_is_told_in_json_too(tmp_path: Path, space_robot: Run) -> None:
    given = ["simulate", "--controller", "ctc", "--gains", "printed", "--duration", "1", "--json"]
    for options in ([], ["--bag", str(tmp_path / "bag")]):
        code, out, err = space_robot(*given, *options)
        assert code == 1
        report = json.loads(out)
        assert (report["controller"], report["gains"]) == ("ctc", "printed")
        tick = report["diverged"]["tick"]
        assert f"diverged at tick {tick}" in report["error"]
        assert report["error"] in err
        assert (report["outcome"], report["reason"]) == ("diverged", report["error"])
        assert report["diverged"]["time_s"] == pytest.approx(tick * 0.0005)
    assert 0 < report["ticks"] <= tick + 1
    assert report["bag"] == str(tmp_path / "bag")


@pytest.mark.parametrize("name", ["c.parquet", "[a]*.csv"])
def test_what_a_killed_process_has_left_is_removed_by_the_next_one(
    name: str, tmp_path: Path
) -> None:
    """Not what may still be written, and not what has another name."""
    left, folder, new, other = (
        tmp_path / f".{text}"
        for text in (f"{name}.0123abcd", f"{name}.ffffffff", f"{name}.00000000", "x.0123abcd")
    )
    folder.mkdir()
    (folder / "inner").write_text("half", "utf-8")
    for path in (left, new, other):
        path.write_text("half", "utf-8")
    for path in (left, folder, other):
        before = path.stat().st_mtime - 2.0 * ABANDONED_S
        os.utime(path, (before, before))
    with atomic_file(tmp_path / name) as file:
        file.write(b"whole")
    assert (tmp_path / name).read_text("utf-8") == "whole"
    assert sorted(tmp_path.iterdir()) == sorted([tmp_path / name, new, other])


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    with pytest.raises(InputError, match="cannot be written"), atomic_folder(folder) as place:
        (place / "a").rename(place / "b")
    assert not [*tmp_path.iterdir()]
    for text in ("1", "2"):
        with atomic_folder(folder) as place:
            (place / "a").write_text(text, "utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["one"]
    assert (folder / "a").read_text("utf-8") == "2"
