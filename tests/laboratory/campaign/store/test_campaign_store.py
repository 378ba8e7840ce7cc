"""Journal and table keep every digit; the same rows give the same bytes; nobody else's folder."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.store.folder import begin_or_resume, held_folder
from space_robot.campaign.store.journal import Journal
from space_robot.campaign.store.journal_codec import JournalCodec
from space_robot.campaign.store.journal_file import damage_of, whole_rows, write_journal
from space_robot.campaign.store.manifest import Manifest, read_manifest
from space_robot.campaign.store.schema import Schema
from space_robot.campaign.store.software import file_digests, flight_digest, source_digest
from space_robot.campaign.store.table import file_digest, read_table, table_rows, write_table
from space_robot.campaign.study import Study
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.tree import Visual
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
        task,
        "complete",
        "",
        draw(FLOATS),
        vary,
        {"m": draw(FLOATS)},
        {"r": draw(FLOATS)},
        {"s": band},
    ).digested()


CODEC = JournalCodec("campaign", LAWS)


def journal_of(path: Path, rows: Iterable[Row] = ()) -> Journal:
    write_journal(path, CODEC, rows)
    return Journal(path, CODEC)


@pytest.mark.parametrize("name", ["journal.db", "campaign.json", "table.parquet.sha256", ".lock"])
def test_a_pipe_in_the_place_of_a_file_is_refused(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=f"{name}: not a file"), held_folder(tmp_path):
        pass


@settings(max_examples=12)
@given(st.lists(rows(), max_size=8), st.randoms(use_true_random=False))
def test_order_of_arrival_leaves_no_trace(
    tmp_path_factory: pytest.TempPathFactory, found: list[Row], random: object
) -> None:
    folder = tmp_path_factory.mktemp("store")
    unique = list({row.task: row for row in found}.values())
    with journal_of(folder / "one.db", unique) as journal:
        kept = list(journal.rows(100))
        write_table(folder / "one", SCHEMA, "c", kept)
    random.shuffle(unique)  # type: ignore[attr-defined]
    with journal_of(folder / "two.db", unique[::2]) as journal:
        for row in unique[1::2]:
            journal.add(row)
        write_table(folder / "two", SCHEMA, "c", journal.rows(100))
    assert (folder / "one").read_bytes() == (folder / "two").read_bytes()
    expected = sorted(unique, key=lambda row: (row.task.run, LAWS.index(row.task.law)))
    assert [row.task for row in kept] == [row.task for row in expected]
    for ours, theirs in zip(kept, expected, strict=True):
        assert ours.digest == ours.digested().digest == theirs.digest
    # the table has all of a row, too
    write_table(folder / "three", SCHEMA, "c", table_rows(folder / "one", SCHEMA))
    assert (folder / "one").read_bytes() == (folder / "three").read_bytes()


@settings(max_examples=60)
@given(row=rows(), data=st.data())
def test_a_stored_row_decodes_as_itself_or_not_at_all(row: Row, data: st.DataObject) -> None:
    """Whatever becomes of one of its values, and in whichever journal it is read."""
    stored = CODEC.encode(row)
    decoded = CODEC.decode(stored)
    assert decoded is not None
    assert decoded.digested().digest == row.digest == decoded.digest
    assert decoded.task == row.task
    place = data.draw(st.integers(0, 5))
    other = data.draw(
        st.one_of(
            st.none(), st.integers(-2, 30), st.floats(), st.text(max_size=3), st.binary(max_size=9)
        )
    )
    if other != stored[place]:
        assert CODEC.decode((*stored[:place], other, *stored[place + 1 :])) is None
    for text in (stored[3], stored[5]):
        at = data.draw(st.integers(0, len(text) - 1))
        flipped = text[:at] + chr(ord(text[at]) ^ 1) + text[at + 1 :]
        assert CODEC.decode([flipped if v == text else v for v in stored]) is None
    assert JournalCodec("another", LAWS).decode(stored) is None
    assert JournalCodec("campaign", ["ctc=tuned", "tde_stc"]).decode(stored) is None


def test_a_table_has_every_column_and_nulls_for_what_is_not_there(tmp_path: Path) -> None:
    band = np.array([1.0, 2.0, 3.0], np.float32)
    ended = Row(
        Task(0, "tde_stc"),
        "complete",
        "",
        1.5,
        {"mass": 0.1, "word": "a"},
        {"m": 1e-300},
        {"r": 2.0},
        {"s": band},
        "d",
    )
    early = Row(Task(0, "ctc=tuned"), "killed", "its process died", vary={"mass": 0.2, "word": "b"})
    write_table(tmp_path / "t", SCHEMA, "c", [ended, early])
    table = read_table(tmp_path / "t", SCHEMA)
    assert list(table) == [
        "run",
        "law",
        "outcome",
        "reason",
        "ended_at_s",
        "vary.mass",
        "vary.word",
        "metric.m",
        "require.r",
        "band.s",
        "digest",
    ]
    assert table["metric.m"].tolist()[0] == 1e-300
    assert table["metric.m"].isna().tolist() == [False, True]
    assert table["vary.word"].tolist() == ["a", "b"]
    assert table["band.s"][0].dtype == np.float32
    assert table["band.s"][1] is None


def test_a_row_half_written_is_no_row(tmp_path: Path) -> None:
    """The process ends by SIGKILL in the middle of a transaction."""
    path = tmp_path / "journal.db"
    with journal_of(path) as journal:
        journal.add(Row(Task(0, "tde_stc"), "complete"))
    script = (
        "import os, sqlite3, sys; d = sqlite3.connect(sys.argv[1], isolation_level=None);"
        "d.execute('BEGIN'); d.execute('PRAGMA cache_size=1');"
        "[d.execute('INSERT INTO rows VALUES (?,0,?,?,?,?)', (k, 'x', '{}', b'1'*9999, ''))"
        " for k in range(1, 99)]; os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", script, str(path)], check=False).returncode == -9
    assert not damage_of(path, CODEC)
    with Journal(path, CODEC) as journal:
        assert [row.task.run for row in journal.rows(100)] == [0]


def test_of_a_damaged_journal_every_row_that_is_whole_is_kept(tmp_path: Path) -> None:
    """Hundreds of rows, so that there are inner pages; rows are lost only from damaged pages."""
    band = {"s": np.arange(100, dtype=np.float32)}
    all_rows = [Row(Task(k, law), "complete", bands=band) for k in range(150) for law in LAWS]
    good, path = tmp_path / "good.db", tmp_path / "journal.db"
    write_journal(good, CODEC, all_rows)
    data = good.read_bytes()
    assert not damage_of(good, CODEC)
    for place in range(1, len(data), len(data) // 25):
        path.write_bytes(data[:place] + bytes([data[place] ^ 16]) + data[place + 1 :])
        damage = damage_of(path, CODEC)
        kept = {row.task for row in whole_rows(path, CODEC)}
        if len(kept) < len(all_rows):
            assert damage
        if place > 2 * 4096:  # not the pages of the schema and of the root
            assert len(kept) >= len(all_rows) - 30
    middle = len(data) // 2 // 4096 * 4096
    path.write_bytes(data[:middle] + bytes(4096) + data[middle + 4096 :])
    kept = {row.task for row in whole_rows(path, CODEC)}  # before the lost page, and behind it
    assert {all_rows[0].task, all_rows[-1].task} < kept
    assert len(all_rows) - 30 <= len(kept) < len(all_rows)
    path.write_bytes(data[: len(data) // 2])
    assert damage_of(path, CODEC)
    path.write_text("no database at all" * 100)
    assert damage_of(path, CODEC) == ["file is not a database"]
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=r"journal\.db: unable to open database file"):
        damage_of(path, CODEC)


@pytest.mark.parametrize("size", [0, 1, 4097, 2**20 - 1, 2**20 + 1, 3 * 2**20 + 5])
def test_the_digest_of_a_file_is_of_all_of_it(tmp_path: Path, size: int) -> None:
    path, data = tmp_path / "file", bytes(range(251)) * (size // 251 + 1)
    path.write_bytes(data[:size])
    assert file_digest(path) == hashlib.sha256(data[:size]).hexdigest()


@settings(max_examples=25)
@given(st.sampled_from([10, 4097, 70_000, 2**21]), st.data())
def test_any_byte_of_any_source_changes_the_digest_of_the_software(
    tmp_path_factory: pytest.TempPathFactory, size: int, data: st.DataObject
) -> None:
    root = tmp_path_factory.mktemp("root")
    for package in (
        "space_robot_msgs_py",
        "space_robot_model",
        "space_robot_sim/deep",
        "space_robot_control",
        "space_robot",
    ):
        (root / package).mkdir(parents=True)
        (root / package / "one.py").write_bytes(b"x" * size)
    before = source_digest(root)
    changed = data.draw(st.sampled_from(sorted(root.rglob("*.py"))))
    place = data.draw(st.sampled_from([0, size // 2, size - 1]) | st.integers(0, size - 1))
    content = bytearray(changed.read_bytes())
    content[place] ^= 1
    changed.write_bytes(content)
    assert source_digest(root) != before
    changed.write_bytes(b"x" * size)
    assert source_digest(root) == before
    changed.rename(changed.with_name("two.py"))
    assert source_digest(root) != before


def test_a_full_disk_is_told_in_a_line(tmp_path: Path) -> None:
    with journal_of(tmp_path / "journal.db") as journal:
        journal.add(Row(Task(0, "tde_stc"), "complete"))
        pages = journal._database.execute("PRAGMA page_count").fetchone()[0]
        journal._database.execute(f"PRAGMA max_page_count = {pages}")
        band = {"s": np.zeros(9999, np.float32)}
        with pytest.raises(InputError, match=r"database or disk is full; the same command"):
            journal.add(Row(Task(1, "tde_stc"), "complete", bands=band))
        assert [row.task.run for row in journal.rows(9)] == [0]


def content_of(study: dict[str, object]) -> dict[str, object]:
    return Study.model_validate(study).content


STUDY = "laws: [tde_stc, ctc=tuned]\nvary: {a: {normal: 1.0}}\n"


def manifest(**other: object) -> Manifest:
    content = {
        "seed": 7,
        "runs": 20,
        "study": content_of({"laws": LAWS, "vary": {"a": {"normal": 1.0}}}),
        "software": {"numpy": "2.0"},
        "commit": None,
        "files": {},
        "flights": {"tde_stc": "f"},
        "table": SCHEMA.model_dump(),
    }
    return Manifest.model_validate({**content, **other})


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"seed": 8}, "another seed: 7 then, 8 now"),
        ({"software": {"numpy": "2.1"}}, "another software: numpy: '2.0' then, '2.1' now"),
        (
            {"study": content_of({"laws": LAWS, "vary": {"a": {"normal": 2.0}}})},
            "another file: vary.a.normal: 1.0 then, 2.0 now",
        ),
        ({"files": {"my.yaml": "f"}}, "another named file: my.yaml: None then, 'f' now"),
        ({"runs": 19}, "started with 20 runs, 19 are requested: request 20 or more"),
    ],
)
def test_another_campaign_is_refused_in_a_line(
    tmp_path: Path, other: dict[str, object], said: str
) -> None:
    folder = tmp_path / "a"
    with held_folder(folder):
        assert not begin_or_resume(folder, manifest(), STUDY)
        assert not begin_or_resume(folder, manifest(), STUDY)
        with pytest.raises(InputError) as refused:
            begin_or_resume(folder, manifest(**other), STUDY)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert read_manifest(folder / "campaign.json") == manifest()


@pytest.mark.parametrize(
    ("before", "after"),
    [('"seed": 7', '"seed": 5'), ("1.0", "9.0"), ('"numpy": "2', '"numpy": "3'), ("[", "[ ")],
)
def test_a_value_of_the_manifest_that_was_changed_is_noticed(
    tmp_path: Path, before: str, after: str
) -> None:
    path = tmp_path / "campaign.json"
    manifest().write(path)
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))
    if after.strip() == before:  # a blank changes no value
        assert read_manifest(path) == manifest()
        return
    with pytest.raises(InputError, match=r"campaign\.json: damaged or edited"):
        read_manifest(path)


def test_more_runs_extend_unless_the_design_forbids(tmp_path: Path) -> None:
    for design, name in (("sobol", "a"), ("latin_hypercube", "b")):
        study = content_of({"laws": LAWS, "design": design})
        with held_folder(tmp_path / name):
            begin_or_resume(tmp_path / name, manifest(study=study), "")
            if design == "sobol":
                begin_or_resume(tmp_path / name, manifest(study=study, runs=40), "")
                continue
            with pytest.raises(InputError, match="latin_hypercube design cannot be extended"):
                begin_or_resume(tmp_path / name, manifest(study=study, runs=40), "")
    fixed = content_of({"laws": LAWS, "fixed_runs": True})
    with held_folder(tmp_path / "c"):
        begin_or_resume(tmp_path / "c", manifest(study=fixed), "")
        with pytest.raises(InputError, match="its file has fixed_runs: true"):
            begin_or_resume(tmp_path / "c", manifest(study=fixed, runs=40), "")


def test_one_process_at_a_time(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()

    def hold() -> None:
        try:
            with held_folder(tmp_path):
                theirs.send("held")
        except InputError as error:
            theirs.send(str(error))

    with held_folder(tmp_path):
        context.Process(target=hold).start()
        assert "another process is flying this campaign" in ours.recv()
    context.Process(target=hold).start()
    assert ours.recv() == "held"


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    said = r"contains thesis\.tex and no "
    with pytest.raises(InputError, match=said), held_folder(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_begin_that_was_killed_is_begun_again(tmp_path: Path) -> None:
    for name in (".lock", "campaign.yaml", ".campaign.json.0a1b2c3d"):
        (tmp_path / name).write_text("half")
    with held_folder(tmp_path):
        assert not begin_or_resume(tmp_path, manifest(), STUDY)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {".lock", "campaign.yaml", "campaign.json"}
    assert (tmp_path / "campaign.yaml").read_text() == STUDY


def test_of_the_names_in_a_file_those_of_settings_and_laws_are_digested(tmp_path: Path) -> None:
    """Not a folder, and not a file of another kind that a text happens to name."""
    settings_file, law, other = (tmp_path / name for name in ("a.yaml", "law.py", "notes.txt"))
    for file in (settings_file, law, other):
        file.write_text(file.name)
    (tmp_path / "folder.yaml").mkdir()
    names = [str(settings_file), f"{law}:Law", str(other), str(tmp_path / "folder.yaml"), "b.yaml"]
    found = file_digests({"values": names})
    assert set(found) == {str(settings_file), str(law)}
    assert found[str(settings_file)] != found[str(law)]


def test_where_a_mesh_is_does_not_change_a_flight() -> None:
    """So a campaign goes on where its robot's files are in another folder."""

    def digest(mesh: str, scale: float = 1.0) -> str:
        shape = Visual("mesh", (scale, 1.0, 1.0), np.eye(3), np.zeros(3), mesh)
        robot = replace(find_robot("paper"), visuals=(shape,))
        return flight_digest(Flight(resolve(FlightPlan(robot=robot, duration=0.01))))

    assert digest("/a.stl") == digest("/b.stl") != digest("/a.stl", 2.0)
