"""A campaign's table depends on file, seed and runs alone: not on workers, kills, or extensions."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from space_robot import load_bag
from space_robot.campaign.flown import Campaign, FlownCampaign, campaign, flights, precision
from space_robot.campaign.flown.flights import Progress
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.report.subject import subject_of
from space_robot.campaign.row.row import Task
from space_robot.campaign.study import Study
from space_robot.flight.compilation import compile_kernels
from space_robot.processes.pool import Done, WorkerDiedError, run_many
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")
RUNS = 20
CONTENT: dict[str, Any] = {
    "scenario": {"case": "3", "sensors": "fine", "duration": 0.2},
    "laws": ["tde_stc", "ctc=tuned"],
    "vary": {
        "robot.links[*].mass": {"normal": 1.0, "sigma": 0.05, "relative": True},
        "scenario.sensors": {"choice": ["fine", "ideal"]},
    },
    "require": {"pointing": {"metric": "attitude_max", "from_s": 0.1, "below": 1e-6, "in": 0.9}},
}


def study(**other: Any) -> Study:
    return Study.model_validate({**CONTENT, **other})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> FlownCampaign:
    """In this process."""
    folder = tmp_path_factory.mktemp("campaigns") / "undisturbed"
    return Campaign(study()).run(RUNS, 7, folder, workers=0)


def table_of(folder: Path) -> bytes:
    return (folder / "table.parquet").read_bytes()


def test_killed_again_and_again_it_has_the_same_table(
    undisturbed: FlownCampaign, tmp_path: Path
) -> None:
    """By SIGKILL, after some flights and a little more, with one worker and with two."""
    compile_kernels()
    chance, context = random.Random(5), multiprocessing.get_context("fork")
    folder, kept = tmp_path / "killed", []

    def fly(workers: int, end: Any) -> None:
        def told(progress: Progress) -> None:
            end.send(progress.done)

        Campaign(study()).run(RUNS, 7, folder, workers=workers, progress=told)

    for kill in range(6):
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=fly, args=(1 + kill % 2, theirs))
        process.start()
        theirs.close()
        try:
            first = ours.recv()
            kept.append(first)
            for _ in range(chance.randint(0, 1)):  # groups of flights
                ours.recv()
        except EOFError:  # all is flown
            process.join()
            break
        process.join(chance.uniform(0.0, 0.03))
        os.kill(process.pid or 0, signal.SIGKILL)
        process.join()
        ours.close()
    assert kept == sorted(kept)
    assert len(kept) > 2
    assert kept[-1] > 0
    found = Campaign(study()).run(RUNS, 7, folder, workers=2)
    assert found.kept >= kept[-1]
    assert table_of(folder) == table_of(undisturbed.folder)


def test_the_same_line_again_does_nothing(undisturbed: FlownCampaign) -> None:
    before = {path: path.stat().st_mtime_ns for path in undisturbed.folder.glob("table*")}
    told: list[Progress] = []
    again = Campaign(study()).run(RUNS, 7, undisturbed.folder, workers=0, progress=told.append)
    assert not told
    assert again.kept == 2 * RUNS
    assert {path: path.stat().st_mtime_ns for path in undisturbed.folder.glob("table*")} == before


def test_a_table_that_was_spoiled_is_written_again(
    undisturbed: FlownCampaign, tmp_path: Path
) -> None:
    before = table_of(undisturbed.folder)
    (undisturbed.folder / "table.parquet").write_bytes(before[:1000])
    Campaign(study()).run(RUNS, 7, undisturbed.folder, workers=0)
    assert table_of(undisturbed.folder) == before


def test_more_runs_extend_it(undisturbed: FlownCampaign, tmp_path: Path) -> None:
    few = Campaign(study()).run(3, 7, tmp_path / "a", workers=0)
    assert len(few.table) == 6
    Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0)
    assert table_of(tmp_path / "a") == table_of(undisturbed.folder)


def test_ctrl_c_leaves_the_table_of_what_is_done(
    undisturbed: FlownCampaign, tmp_path: Path
) -> None:
    def told(progress: Progress) -> None:
        if progress.done >= 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0, progress=told)
    rows, key = FlownCampaign.open(tmp_path / "a").table, ["run", "law"]
    assert 5 <= len(rows) < 2 * RUNS
    every = undisturbed.table.set_index(key)["digest"]
    assert rows.set_index(key)["digest"].equals(every[rows.set_index(key).index])


def test_any_row_flies_again_to_the_same_bits(undisturbed: FlownCampaign) -> None:
    for law in (None, "ctc=tuned"):
        again = FlownCampaign.open(undisturbed.folder).rerun(11, law)
        assert again.is_same, again.verdict
        assert again.log.ticks == 400
    with pytest.raises(InputError, match=r"run 20: .* has no row of this run"):
        undisturbed.rerun(20)
    with pytest.raises(InputError, match="unknown law 'tde': choose one of tde_stc, ctc=tuned"):
        undisturbed.rerun(0, "tde")


def test_a_rerun_that_differs_says_so(undisturbed: FlownCampaign) -> None:
    opened = FlownCampaign.open(undisturbed.folder)
    table = opened.table
    table.loc[table.index[22], "digest"] = "0" * 32
    again = opened.rerun(11)
    assert not again.is_same
    assert "differs from the row's 0000" in again.verdict


def test_a_flight_whose_worker_died_is_a_row_and_is_tried_again(
    undisturbed: FlownCampaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(function: Any, items: Any, **options: Any) -> Iterator[Any]:
        for done in run_many(function, items, **options):
            if Task(4, "tde_stc") in done.item:  # with others, then alone
                yield Done(done.item, None, WorkerDiedError("its process died"))
            else:
                yield done

    with monkeypatch.context() as patch:
        patch.setattr(flights, "run_many", run)
        found = Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0)
    row = found.table.iloc[8]
    assert (row["outcome"], row["reason"]) == ("killed", "its process died")
    assert row["vary.scenario.sensors"] == undisturbed.table.iloc[8]["vary.scenario.sensors"]
    assert (found.table["outcome"] == "complete").sum() == 2 * RUNS - 1
    Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0)
    assert table_of(tmp_path / "a") == table_of(undisturbed.folder)


def test_it_stops_at_a_precision_whoever_flies_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = {**CONTENT, "laws": ["tde_stc"], "scenario": {"duration": 0.005}}
    content["require"] = {"p": {"metric": "attitude_max", "below": 1.0, "in": 0.9}}
    content["vary"] = {"scenario.case": {"grid": ["1", "2"]}}
    content["until"] = {"half_width": 0.4, "runs": 50}
    monkeypatch.setattr(precision, "CHECKED_EVERY", 5)
    asked = Campaign(Study.model_validate(content))
    one = asked.run(out=tmp_path / "one", workers=0)
    asked.run(out=tmp_path / "two", workers=2)
    assert one.table["vary.scenario.case"].value_counts().tolist() == [5, 5]
    remarks = Findings(subject_of(one)).remarks
    assert not any("not finished" in remark for remark in remarks)
    assert table_of(tmp_path / "one") == table_of(tmp_path / "two")


def test_failures_are_kept_as_bags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep = Campaign(study(keep={"bag": "on_failure"}, scenario={"duration": 0.05}, vary={}))
    keep.study.require["pointing"] = keep.study.require["pointing"].model_copy(
        update={"below": 1e-30, "from_s": 0.0}
    )
    (tmp_path / "a/bags/.0_tde_stc").mkdir(parents=True)
    (tmp_path / "a/campaign.yaml").write_text("")
    with pytest.raises(InputError, match="another one"):
        keep.run(1, 7, tmp_path / "a", workers=0)
    found = keep.run(1, 7, tmp_path / "b", workers=0)
    kept = sorted(path.name for path in (tmp_path / "b/bags").iterdir())
    assert kept == ["0_ctc=tuned", "0_tde_stc"]
    bag = load_bag(tmp_path / "b/bags/0_ctc=tuned")
    assert (bag.quaternion == found.rerun(0, "ctc=tuned").log.quaternion).all()
    (tmp_path / "b/bags/0_tde_stc").rename(tmp_path / "b/bags/.0_tde_stc")  # killed while at it
    keep.run(1, 7, tmp_path / "b", workers=0)
    assert sorted(path.name for path in (tmp_path / "b/bags").iterdir()) == kept
    assert campaign.bag_name(Task(3, "ctc=my/gains")) == "3_ctc=my_gains"


def test_without_a_folder_it_lasts_as_long_as_the_object() -> None:
    found = Campaign(study(vary={}, scenario={"duration": 0.02}, require={})).run(1, workers=0)
    folder = found.folder
    assert len(found.table) == 2
    assert not found.verdicts
    del found
    assert not folder.exists()


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"laws": ["tde_st"]}, "campaign: law tde_st: .*tde_stc"),
        (
            {"require": {"p": {"metric": "atitude_max", "below": 1.0, "in": 0.9}}},
            "campaign: require.p.metric: .*attitude_max",
        ),
        (
            {"require": {"p": {"metric": "ripple_base_torque", "below": 1.0, "in": 0.9}}},
            "campaign: require.p.metric: ripple_base_torque needs 1 s of flight, got 0.2 s",
        ),
        (
            {
                "require": {"p": {"metric": "attitude_max", "below": 1.0, "in": 0.9}},
                "vary": {"scenario.actuators": {"grid": ["ideal", "none"]}},
            },
            r"campaign: require.p.metric: .*\(scenario.actuators: none\)",
        ),
    ],
)
def test_what_cannot_be_flown_is_told_before_anything_is_made(
    tmp_path: Path, other: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        Campaign(study(**other)).run(2, out=tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_a_mapping_is_as_good_as_a_file(tmp_path: Path) -> None:
    """The folder has it as a file, from which a row flies again."""
    content = study().model_dump(by_alias=True)
    found = Campaign.of(content).run(1, 7, tmp_path / "a", workers=0)
    assert found.study.model_dump() == study().model_dump()
    assert found.rerun(0).is_same
    with pytest.raises(InputError, match=r"campaign: .*laws"):
        Campaign.of({"runs": 3})


def test_a_seed_is_zero_or_more(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="seed: 0 or more is allowed, got -1"):
        Campaign(study()).run(1, -1, tmp_path / "none", workers=0)
    assert not (tmp_path / "none").exists()
