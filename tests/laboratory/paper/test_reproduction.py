"""Table V flown again: the numbers it must show, and the files it writes."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from command import Run

from space_robot.paper.flights import (
    COLUMNS,
    ROWS,
    VARIANTS,
    Equipment,
    Result,
    TableRow,
    Variant,
    fly,
    plan,
)
from space_robot.paper.reproduce import (
    check_results_folder,
    compare_with_table,
    judge_claims,
    reproduce,
)
from space_robot_msgs_py.errors import InputError

SHORT = 0.4


@pytest.fixture(scope="module")
def time_delay_flights() -> list[Result]:
    """Every TDE row of Table V over the whole mission, printed gains, with friction and without."""
    return [
        fly((row, Variant("printed", friction)))
        for row in ROWS
        if row.controller.startswith("tde")
        for friction in (True, False)
    ]


def test_verdicts_on_the_claims(time_delay_flights: list[Result]) -> None:
    """Torques within 1 %, errors below the printed ones, 5 and 100 times smoother; and what fails.

    Tuned TDE-TSMC is the smoother one, and payload and disturbance more than double an error.
    """
    tuned = fly((TableRow("tde_tsmc", "1"), Variant("tuned", True)))
    judged = judge_claims([*time_delay_flights, tuned], compare_with_table(time_delay_flights))
    assert [claim.holds for claim in judged] == [True] * 4 + [False, True, False, False, False]
    smoothest, *growth = judged[4:]
    assert smoothest.value == pytest.approx(0.95, rel=0.01)
    assert [claim.value for claim in growth] == pytest.approx([1.86, 2.41, 2.38, 3.97], rel=0.02)


def test_tde_smc_chatters_as_the_prototype_did(time_delay_flights: list[Result]) -> None:
    """103, 2.6 and 0.33 N m/s."""
    variation = {
        r.row.controller: r.chatter["variation"]["base_torque"]
        for r in time_delay_flights
        if r.chatter
    }
    assert variation["tde_smc"] == pytest.approx(103.0, rel=0.05)
    assert variation["tde_tsmc"] == pytest.approx(2.6, rel=0.05)
    assert variation["tde_stc"] == pytest.approx(0.33, rel=0.05)


def test_rows_fly_with_sensors_that_are_not_ideal() -> None:
    """And with the ideal ones if none are named."""
    planned = (TableRow("tde_stc", "1"), Variant("printed", True)), 0.05, None
    ideal, noisy = fly(*planned), fly(*planned, Equipment("white_l1", "filtered"))
    told = [result.parameters["plant"] for result in (ideal, noisy)]
    assert [(plant["sensors"], plant["gyro"]["noise"]) for plant in told] == [
        ("ideal", 0.0),
        ("white_l1", 1e-6),
    ]
    assert ideal.parameters["navigation"] == "direct"
    assert noisy.parameters["navigation"]["tracker_across"] == 1e-5
    assert ideal.metrics != noisy.metrics


def test_printed_computed_torque_gains_diverge_within_ticks() -> None:
    result = fly((TableRow("ctc", "1"), Variant("printed", True)))
    assert result.metrics is None
    assert result.diverged_tick is not None
    assert result.diverged_tick < 20
    (cell, *_) = compare_with_table([result])
    assert cell.measured is None
    assert cell.ratio is None
    assert not judge_claims([result], compare_with_table([result])), (
        "a diverged flight decides no claim"
    )


def test_what_is_flown_in_brief() -> None:
    """All 17 rows with friction and without; the printed gains too where they are not flown."""
    planned = list(plan(ROWS, brief=True))
    assert len(planned) == len(set(planned)) == 17 * 2 + 6
    for row in ROWS:
        flown = {variant for flown_row, variant in planned if flown_row == row}
        default = "tuned" if row.controller.startswith("ctc") else "printed"
        expected = {Variant(default, True), Variant(default, False), Variant("printed", True)}
        assert flown == expected
        assert row.shown == Variant(default, True)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, Any]]:
    """Two reproductions of two rows, one after the other, the second of them in brief."""
    folder = tmp_path_factory.mktemp("reproduction")
    rows = [TableRow("ctc", "1"), TableRow("tde_stc", "4-2")]
    first, second = folder / "first", folder / "below" / "second"
    record = reproduce(rows, first, duration=SHORT, jobs=2)
    reproduce(rows, second, duration=SHORT, jobs=1, brief=True)
    return first, second, record


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_two_runs_write_the_same_bytes(twice: tuple[Path, Path, dict[str, Any]]) -> None:
    """Whatever the number of processes, and what else they fly."""
    first, second, record = twice
    written, again = files(first), files(second)
    assert {"report.html", "table_v.md", "table_v.csv", "table_v.json"} <= set(written) & set(again)
    for stem in ("case1_ctc", "case4-2_tde_stc", "figure5_desired_joints", "chatter", "junctions"):
        assert f"figures/{stem}.png" in written
        assert again[f"figures/{stem}.svg"] == written[f"figures/{stem}.svg"], stem
    cells = json.loads(again["table_v.json"])["cells"]
    assert cells
    assert [cell for cell in cells if cell not in record["cells"]] == []
    leftovers = [p.name for p in first.parent.iterdir() if p.name.startswith(".")]
    assert not leftovers


def test_csv_json_and_markdown_say_the_same(twice: tuple[Path, Path, dict[str, Any]]) -> None:
    folder, _, record = twice
    assert json.loads((folder / "table_v.json").read_text()) == record
    rows = list(csv.DictReader((folder / "table_v.csv").read_text().splitlines()))
    assert len(rows) == len(record["cells"]) == 2 * len(VARIANTS) * 2 * len(COLUMNS)
    for row, cell in zip(rows, record["cells"], strict=True):
        assert row["printed"] == str(cell["printed"])
        assert row["measured"] == ("" if cell["measured"] is None else repr(cell["measured"]))
    markdown = (folder / "table_v.md").read_text()
    assert "diverged at tick" in markdown
    cell = next(c for c in record["cells"] if c["column"] == "base_torque" and c["measured"])
    assert f"{cell['measured']:.4f} / {cell['printed']:.4f} ({cell['ratio']:.3f})" in markdown


def test_an_older_reproduction_is_replaced(
    twice: tuple[Path, Path, dict[str, Any]], space_robot: Run
) -> None:
    _, folder, _ = twice
    (folder / "figures" / "old.svg").write_text("of an older run")
    only = ("--only", "tde_stc/1", "--duration", SHORT, "--brief", "--jobs", 1)
    ran = space_robot("reproduce", "--out", folder, *only)
    assert ran.code == 0, ran.err
    drawn = {path.name for path in (folder / "figures").iterdir()}
    assert "case1_tde_stc.svg" in drawn
    assert not {"old.svg", "case1_ctc.svg", "case1_tde_stc.png"} & drawn


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="contains other files"):
        check_results_folder(tmp_path)
    with pytest.raises(InputError, match="not a folder"):
        check_results_folder(tmp_path / "thesis.tex")
    assert files(tmp_path) == {"thesis.tex": b"years of work"}


def test_a_base_that_nothing_turns_is_not_table_vs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="actuators none: Table V has attitude errors"):
        reproduce(ROWS[:1], tmp_path / "out", jobs=1, equipment=Equipment(actuators="none"))
    assert not list(tmp_path.iterdir())
