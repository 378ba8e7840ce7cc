"""Journal and table keep every digit; the same rows give the same bytes; nobody else's folder."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot_control.campaign.row.row import Row, Task
from space_robot_control.campaign.store.folder import begin_or_resume, held_folder
from space_robot_control.campaign.store.journal import Journal
from space_robot_control.campaign.store.manifest import Manifest, read_manifest
from space_robot_control.campaign.store.schema import Schema
from space_robot_control.campaign.store.table import read_table, write_table
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")
LAWS = ["tde_stc", "ctc=tuned"]
SCHEMA = Schema(
    grid={},
    vary={"mass": "float64", "word": "str"},
    metrics=["m"],
    require=["r"],
    bands=["s"],
    bins=3,
)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def rows(draw: st.DrawFn) -> Row:
    task = Task(draw(st.integers(0, 20)), draw(st.sampled_from(LAWS)))
    vary = {"mass": draw(FLOATS), "word": draw(st.sampled_from(["a", "ß\n"]))}
    if draw(st.booleans()):
        return Row(task, "diverged", draw(st.text(max_size=5)), draw(FLOATS), vary).digested()
    band = np.array(draw(st.lists(st.floats(width=32), min_size=3, max_size=3)), np.float32)
    return Row(
        task, "complete", "", draw(FLOATS), vary, {"m": draw(FLOATS)}, {"r": draw(FLOATS)},
        {"s": band},
    ).digested()  # fmt: skip


@settings(max_examples=25)
@given(st.lists(rows(), max_size=8), st.randoms(use_true_random=False))
def test_order_of_arrival_leaves_no_trace(
    tmp_path_factory: pytest.TempPathFactory, found: list[Row], random: object
) -> None:
    folder = tmp_path_factory.mktemp("store")
    unique = list({row.task: row for row in found}.values())
    with Journal(folder / "one.db", LAWS) as journal:
        for row in unique:
            journal.add(row)
        kept = list(journal.rows(100))
        write_table(folder / "one", SCHEMA, kept)
    random.shuffle(unique)  # type: ignore[attr-defined]
    for row in unique[::2]:
        with Journal(folder / "two.db", LAWS) as journal:
            journal.add(row)
    with Journal(folder / "two.db", LAWS) as journal:
        for row in unique[1::2]:
            journal.add(row)
        write_table(folder / "two", SCHEMA, journal.rows(100))
    assert (folder / "one").read_bytes() == (folder / "two").read_bytes()
    expected = sorted(unique, key=lambda row: (row.task.run, LAWS.index(row.task.law)))
    assert [row.task for row in kept] == [row.task for row in expected]
    for ours, theirs in zip(kept, expected, strict=True):
        assert ours.digest == ours.digested().digest == theirs.digest


def test_a_table_has_every_column_and_nulls_for_what_is_not_there(tmp_path: Path) -> None:
    band = np.array([1.0, 2.0, 3.0], np.float32)
    ended = Row(
        Task(0, "tde_stc"), "complete", "", 1.5, {"mass": 0.1, "word": "a"}, {"m": 1e-300},
        {"r": 2.0}, {"s": band}, "d",
    )  # fmt: skip
    early = Row(Task(0, "ctc=tuned"), "killed", "its process died", vary={"mass": 0.2, "word": "b"})
    write_table(tmp_path / "t", SCHEMA, [ended, early])
    table = read_table(tmp_path / "t")
    assert list(table) == [
        "run", "law", "outcome", "reason", "ended_at_s", "vary.mass", "vary.word", "metric.m",
        "require.r", "band.s", "digest",
    ]  # fmt: skip
    assert table["metric.m"].tolist()[0] == 1e-300
    assert table["metric.m"].isna().tolist() == [False, True]
    assert table["vary.word"].tolist() == ["a", "b"]
    assert table["band.s"][0].dtype == np.float32
    assert table["band.s"][1] is None


def test_a_row_half_written_is_no_row(tmp_path: Path) -> None:
    """The process ends by SIGKILL in the middle of a transaction."""
    path = tmp_path / "journal.db"
    with Journal(path, LAWS) as journal:
        journal.add(Row(Task(0, "tde_stc"), "complete"))
    script = (
        "import os, sqlite3, sys; d = sqlite3.connect(sys.argv[1], isolation_level=None);"
        "d.execute('BEGIN'); d.execute('PRAGMA cache_size=1');"
        "[d.execute('INSERT INTO rows VALUES (?,0,?,?,?)', (k, 'x', '{}', b'1'*9999))"
        " for k in range(1, 99)]; os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", script, str(path)], check=False).returncode == -9
    with Journal(path, LAWS) as journal:
        assert [row.task.run for row in journal.rows(100)] == [0]


def test_what_is_no_journal_is_told_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "journal.db").write_text("no database at all" * 100)
    with pytest.raises(InputError, match=r"journal\.db: file is not a database"):
        Journal(tmp_path / "journal.db", LAWS)


def test_a_full_disk_is_told_in_a_line(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal.db", LAWS) as journal:
        journal.add(Row(Task(0, "tde_stc"), "complete"))
        pages = journal._database.execute("PRAGMA page_count").fetchone()[0]
        journal._database.execute(f"PRAGMA max_page_count = {pages}")
        band = {"s": np.zeros(9999, np.float32)}
        with pytest.raises(InputError, match=r"database or disk is full; the rows kept"):
            journal.add(Row(Task(1, "tde_stc"), "complete", bands=band))
        assert [row.task.run for row in journal.rows(9)] == [0]


def manifest(**other: object) -> Manifest:
    content = {
        "seed": 7, "runs": 20, "study": {"laws": LAWS, "vary": {"a": {"normal": 1.0}}},
        "software": {"numpy": "2.0"}, "commit": None, "files": {}, "flights": {"tde_stc": "f"},
        "table": SCHEMA.model_dump(),
    }  # fmt: skip
    return Manifest.model_validate({**content, **other})


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"seed": 8}, "another seed: 7 then, 8 now"),
        ({"software": {"numpy": "2.1"}}, "another software: numpy: '2.0' then, '2.1' now"),
        (
            {"study": {"laws": LAWS, "vary": {"a": {"normal": 2.0}}}},
            "another file: vary.a.normal: 1.0 then, 2.0 now",
        ),
        ({"files": {"my.yaml": "f"}}, "another named file: my.yaml: None then, 'f' now"),
        ({"runs": 19}, "begun with 20 runs, 19 are asked for: give 20 or more"),
    ],
)
def test_another_campaign_is_refused_in_a_line(
    tmp_path: Path, other: dict[str, object], said: str
) -> None:
    folder = tmp_path / "a"
    with held_folder(folder):
        assert not begin_or_resume(folder, manifest(), "text")
        assert begin_or_resume(folder, manifest(), "text")
        with pytest.raises(InputError) as refused:
            begin_or_resume(folder, manifest(**other), "text")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert read_manifest(folder / "campaign.json") == manifest()


def test_more_runs_extend_unless_the_design_forbids(tmp_path: Path) -> None:
    for design, name in (("sobol", "a"), ("latin_hypercube", "b")):
        study = {"design": design}
        with held_folder(tmp_path / name):
            begin_or_resume(tmp_path / name, manifest(study=study), "")
            if design == "sobol":
                begin_or_resume(tmp_path / name, manifest(study=study, runs=40), "")
                continue
            with pytest.raises(InputError, match="latin_hypercube design cannot be extended"):
                begin_or_resume(tmp_path / name, manifest(study=study, runs=40), "")
    with held_folder(tmp_path / "c"):
        begin_or_resume(tmp_path / "c", manifest(study={"fixed_runs": True}), "")
        with pytest.raises(InputError, match="its file has fixed_runs: true"):
            begin_or_resume(tmp_path / "c", manifest(study={"fixed_runs": True}, runs=40), "")


def test_one_process_at_a_time(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path;"
        "from space_robot_control.campaign.store.folder import held_folder\n"
        "with held_folder(Path(sys.argv[1])): pass"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with held_folder(tmp_path):
        second = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "another process flies this campaign now" in second.stderr
    assert subprocess.run(command, check=False).returncode == 0


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    said = r"but thesis\.tex, so it holds something else"
    with pytest.raises(InputError, match=said), held_folder(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_begin_that_was_killed_is_begun_again(tmp_path: Path) -> None:
    for name in (".lock", "campaign.yaml", ".campaign.json.0a1b2c3d"):
        (tmp_path / name).write_text("half")
    with held_folder(tmp_path):
        assert not begin_or_resume(tmp_path, manifest(), "text")
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {".lock", "campaign.yaml", "campaign.json"}
    assert (tmp_path / "campaign.yaml").read_text() == "text"
