"""A campaign's table depends on file, seed and runs alone: not on workers, kills, or extensions."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from space_robot import Scenario, load_bag
from space_robot.campaign.flown import Campaign, FlownCampaign, flights
from space_robot.campaign.flown.flights import CHECKED_EVERY, Precision, Progress
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Study
from space_robot.campaign.verdicts.requirements import Sequential
from space_robot.flight.compilation import compile_kernels
from space_robot.processes.executor import Done, WorkerDiedError, run_many
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
    "require": {"pointing": {"metric": "attitude.max", "from_s": 0.1, "below": 1e-6, "in": 0.9}},
}


def study(**other: Any) -> Study:
    return Study.model_validate({**CONTENT, **other})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> FlownCampaign:
    """In this process."""
    folder = tmp_path_factory.mktemp("campaigns") / "undisturbed"
    return Campaign(study()).run(RUNS, 7, folder, workers=0)


def table_of(folder: Path) -> bytes:
    """The bytes of the exported table."""
    file = folder.parent / f"{folder.name}.csv"
    file.unlink(missing_ok=True)
    FlownCampaign.open(folder).export(file)
    return file.read_bytes()


def test_killed_it_goes_on_to_the_same_table(undisturbed: FlownCampaign, tmp_path: Path) -> None:
    """By SIGKILL, at its second report, with two workers."""
    compile_kernels()
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)

    def fly() -> None:
        def told(progress: Progress) -> None:
            theirs.send(progress.done)

        Campaign(study()).run(RUNS, 7, tmp_path / "killed", workers=2, progress=told)

    process = context.Process(target=fly)
    process.start()
    theirs.close()
    ours.recv()
    done = ours.recv()
    process.kill()
    process.join()
    found = Campaign(study()).run(RUNS, 7, tmp_path / "killed", workers=2)
    assert found.kept >= done > 0
    assert table_of(found.folder) == table_of(undisturbed.folder)


def test_a_cluster_that_loses_a_worker_flies_every_row(
    undisturbed: FlownCampaign, tmp_path: Path
) -> None:
    """With Dask's own number of allowed failures; one of two workers is killed in flight."""
    distributed = pytest.importorskip("distributed")
    options = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": "CRITICAL"}
    killed: list[int] = []

    def kill_one(progress: Progress) -> None:
        if progress.done >= 8 and not killed:
            killed.append(cluster.workers[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **options) as cluster:
        address = cluster.scheduler_address
        asked = {"scheduler": address, "timeout_s": 60.0, "progress": kill_one}  # one by one
        found = Campaign(study()).run(RUNS, 7, tmp_path / "cluster", **asked)
        assert killed[0] != cluster.workers[0].pid
    assert len(found.table) == 2 * RUNS
    assert table_of(found.folder) == table_of(undisturbed.folder)


def test_more_runs_extend_it(undisturbed: FlownCampaign, tmp_path: Path) -> None:
    few = Campaign(study()).run(3, 7, tmp_path / "a", workers=0)
    assert len(few.table) == 6
    Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0)
    assert table_of(tmp_path / "a") == table_of(undisturbed.folder)


def test_any_row_flies_again_to_the_same_bits(undisturbed: FlownCampaign) -> None:
    for law in (None, "ctc=tuned"):
        again = FlownCampaign.open(undisturbed.folder).rerun(11, law)
        assert again.is_same, again.verdict
        assert again.log.ticks == 400
    with pytest.raises(InputError, match=r"run 20: .* has no row of this run"):
        undisturbed.rerun(20)
    with pytest.raises(InputError, match="unknown law 'tde': choose one of tde_stc, ctc=tuned"):
        undisturbed.rerun(0, "tde")


def test_a_flight_by_hand_is_a_row_beside_the_tables(undisturbed: FlownCampaign) -> None:
    """To be appended: the draws of its run, its own law's name, the same digest."""
    flown = undisturbed.scenario(3, "tde_stc").fly()
    row, ours = undisturbed.row_with(flown, 3, "by hand"), undisturbed.table.iloc[6]
    assert list(row.columns) == list(undisturbed.table.columns)
    assert (row["run"][0], row["law"][0], row["digest"][0]) == (3, "by hand", ours["digest"])
    assert row["vary.scenario.sensors"][0] == ours["vary.scenario.sensors"]
    other = Scenario(actuators="none", controller="ctc", duration=0.2).fly()
    with pytest.raises(InputError, match=r"attitude_drift\.max, which is no column of"):
        undisturbed.row_with(other, 3, "by hand")


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
    assert (row["outcome"], row["reason"]) == ("killed", "its process died twice")
    assert row["vary.scenario.sensors"] == undisturbed.table.iloc[8]["vary.scenario.sensors"]
    assert (found.table["outcome"] == "complete").sum() == 2 * RUNS - 1
    Campaign(study()).run(RUNS, 7, tmp_path / "a", workers=0)
    assert table_of(tmp_path / "a") == table_of(undisturbed.folder)


def test_it_stops_at_a_precision_whoever_flies_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = {**CONTENT, "laws": ["tde_stc"], "scenario": {"duration": 0.005}}
    content["require"] = {"p": {"metric": "attitude.max", "below": 1.0, "in": 0.9}}
    content["vary"] = {"scenario.case": {"grid": ["1", "2"]}}
    content["until"] = {"half_width": 0.4, "runs": 50}
    monkeypatch.setattr(flights, "CHECKED_EVERY", 5)
    asked = Campaign(Study.model_validate(content))
    one = asked.run(out=tmp_path / "one", workers=0)
    asked.run(out=tmp_path / "two", workers=2)
    assert one.table["vary.scenario.case"].value_counts().tolist() == [5, 5]
    remarks = Findings.of(one).remarks
    assert not any("not finished" in remark for remark in remarks)
    assert table_of(tmp_path / "one") == table_of(tmp_path / "two")


def test_failures_are_kept_as_bags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep = Campaign(study(keep={"bag": "on_failure"}, scenario={"duration": 0.05}, vary={}))
    keep.study.require["pointing"] = keep.study.require["pointing"].model_copy(
        update={"below": 1e-30, "from_s": 0.0}
    )
    found = keep.run(1, 7, tmp_path / "b", workers=0)
    kept = sorted(path.name for path in (tmp_path / "b/bags").iterdir())
    assert kept == ["0_ctc=tuned", "0_tde_stc"]
    bag = load_bag(tmp_path / "b/bags/0_ctc=tuned")
    assert (bag.quaternion == found.rerun(0, "ctc=tuned").log.quaternion).all()
    (tmp_path / "b/bags/0_tde_stc").rename(tmp_path / "b/bags/.0_tde_stc")  # killed while at it
    keep.run(1, 7, tmp_path / "b", workers=0)
    assert sorted(path.name for path in (tmp_path / "b/bags").iterdir()) == kept
    assert flights.bag_name(Task(3, "ctc=my/gains")) == "3_ctc=my_gains"


def test_without_a_folder_it_lasts_as_long_as_the_object() -> None:
    found = Campaign(study(vary={}, scenario={"duration": 0.02}, require={})).run(1, workers=0)
    folder = found.folder
    assert len(found.table) == 2
    assert not found.verdicts
    del found
    assert not folder.exists()


@settings(max_examples=12, deadline=None)
@given(
    st.integers(1, 3),
    st.sampled_from([0.07, 0.1, 0.13]),
    st.integers(0, 2**32 - 1),
    st.lists(st.sampled_from([0.5, 0.9, 1.0]), min_size=6, max_size=6),
)
@example(3, 0.1, 0, [0.5, 0.5, 1.0, 1.0, 1.0, 1.0])
@example(3, 0.1, 0, [1.0, 1.0, 1.0, 0.5, 1.0, 1.0])
@example(3, 0.1, 0, [1.0, 1.0, 1.0, 1.0, 0.5, 1.0])
def test_the_stop_is_the_first_look_at_which_all_are_narrow_at_each_point(
    points: int, half_width: float, seed: int, rates: list[float]
) -> None:
    """In whole draws: every point and every law has flown as often."""
    both, sensors, bounds = ("tde_stc", "ctc"), ("fine", "coarse", "ideal"), {"p": 1.0, "q": 2.0}
    most = 3 * CHECKED_EVERY
    content = {
        "laws": both,
        "vary": {"scenario.sensors": {"grid": sensors[:points]}},
        "require": {
            name: {"metric": "attitude.max", "below": bound, "in": 0.9}
            for name, bound in bounds.items()
        },
        "until": {"half_width": half_width, "runs": points * most},
    }
    rng = np.random.default_rng(seed)
    met = rng.uniform(size=(most, points, 2)) < np.resize(rates, (points, 2))
    values = np.where(met, 0.5, np.where(rng.uniform(size=met.shape) < 0.5, 1.5, 2.5))
    rows = [
        Row(Task(draw * points + point, law), "complete", require=dict.fromkeys(bounds, value))
        for draw in range(most)
        for point in range(points)
        for law, value in zip(both, values[draw, point].tolist(), strict=True)
    ]
    asked = Study.model_validate(content)
    precision = Precision(asked, points * most, {"scenario.sensors": points})
    for index in rng.permutation(len(rows)).tolist():
        precision.add(rows[index])
    expected = points * most
    for draws in range(CHECKED_EVERY, most + 1, CHECKED_EVERY):
        failures = [(values[:draws] >= bound).sum(axis=0) for bound in bounds.values()]
        intervals = [Sequential(0.9, 0.9).interval(int(k), draws) for k in np.ravel(failures)]
        if max(interval.half_width for interval in intervals) <= half_width:
            expected = draws * points
            break
    assert precision.stop == expected
    assert precision.is_reached == (expected < points * most) or expected == points * most
