"""``space-robot analyze`` and ``replay`` as a user meets them, on bags of real flights."""

from __future__ import annotations

import json
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from command import Run
from PIL import Image

from space_robot.analysis import analyze as report_of
from space_robot.analysis import excerpt
from space_robot.cli.replay_display import COUNTS, counts
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight


@pytest.fixture
def analyze(space_robot: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setenv("COLUMNS", "100")
    return partial(space_robot, "analyze")


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("bags")
    for law in ("tde_stc", "ctc"):
        plan = FlightPlan(controller=law, case="2", duration=0.3)
        simulate(Flight(resolve(plan)), folder / law)
    return folder / "tde_stc", folder / "ctc"


def test_json_of_one_is_an_object_and_of_several_a_list(
    analyze: Run, bags: tuple[Path, Path]
) -> None:
    one, many = analyze(bags[0], "--json"), analyze(*bags, "--json")
    assert json.loads(one.out) == report_of(read_flight(bags[0]))
    assert json.loads(many.out) == [report_of(read_flight(bag)) for bag in bags]
    assert json.loads(many.out)[0] == json.loads(one.out)


def test_one_bag_is_a_table_and_further_figures(analyze: Run, bags: tuple[Path, Path]) -> None:
    result = analyze(bags[0])
    assert result.code == 0
    for words in (
        "RMS, mean",
        "variation",
        "maximum",
        "no limits",
        "arcsec",
        "messages lost: none",
    ):
        assert words in result.out
    assert "settling is counted from the waypoint at 0 s" in result.out
    assert max(map(len, result.out.splitlines())) <= 100


def test_bags_of_one_name_are_told_apart(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    paths = [shutil.copytree(bags[0], tmp_path / day / "flight") for day in ("monday", "tuesday")]
    result = analyze(*paths, "--csv", tmp_path / "csv")
    names = sorted(path.name for path in (tmp_path / "csv").iterdir())
    assert names == ["monday_flight.csv", "tuesday_flight.csv"]
    assert result.code == 0


def test_from_and_to_are_what_all_figures_are_of(analyze: Run, bags: tuple[Path, Path]) -> None:
    result = analyze(bags[0], "--from", 0.1, "--to", 0.2, "--json")
    assert json.loads(result.out) == report_of(excerpt(read_flight(bags[0]), 0.1, 0.2))


def test_pictures_are_pngs_and_renewed(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    """Those of one flight, then of two in the same folder: of the same names, not the same."""
    shown = []
    for count in (1, 2):
        result = analyze(*bags[:count], "--plot", tmp_path / "figures")
        assert result.code == 0
        pictures = {path.name: path for path in (tmp_path / "figures").glob("*.png")}
        assert set(pictures) == {
            "base_pointing.png",
            "desired_joints.png",
            "control_results.png",
            "chatter.png",
            "pointing.png",
        }
        for path in pictures.values():
            with Image.open(path) as image:
                assert image.width > 1000
                assert len(image.getcolors(10**7)) > 50
        shown.append(pictures["control_results.png"].read_bytes())
    assert shown[0] != shown[1]


def test_the_shortest_excerpts_have_what_they_can_have(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    words = ("--from", 0.1, "--to", 0.1005, "--html", tmp_path / "page.html")
    result = analyze(*bags, *words, "--parquet", tmp_path)
    assert result.code == 0
    assert "no settling" in result.out


def test_exports_are_named_and_not_overwritten(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    table = tmp_path / "one.parquet"
    assert analyze(bags[0], "--parquet", table).code == 0
    before = table.read_bytes()
    result = analyze(bags[0], "--parquet", table)
    assert result.code == 2
    assert result.err.strip().endswith(f"{table}: exists already; it is not overwritten")
    assert table.read_bytes() == before


def test_a_bag_that_nobody_finished_is_analysed_and_said_so(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    shutil.copytree(bags[0], tmp_path / "cut")
    (tmp_path / "cut" / "metadata.yaml").unlink()
    file = next((tmp_path / "cut").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-100])
    report = json.loads(analyze(tmp_path / "cut", "--json").out)
    told = [text for text in (report["unfinished"], *report["damage"]) if text]
    assert told
    result = analyze(tmp_path / "cut", "--html", tmp_path / "cut.html")
    assert result.code == 0
    for text in told:
        assert text in " ".join(result.out.split())
    assert "not whole" in (tmp_path / "cut.html").read_text("utf-8")


def test_a_robot_that_is_not_here_costs_only_its_figures(analyze: Run, tmp_path: Path) -> None:
    flight = Flight(resolve(FlightPlan(duration=0.05)))
    log = simulate(flight)
    log.flight.pop("robot_file", None)
    log.flight["robot"] = "elsewhere"
    report = report_of(log)
    assert report["pointing"] is None
    assert "unknown robot 'elsewhere'" in report["unavailable"]["pointing"]
    assert report["rms"]["mean_axis"]["attitude"] > 0.0
    log.flight["robot"] = "seven_joint"
    assert "has the joints" in report_of(log)["unavailable"]["pointing"]


def test_band_and_window_are_those_of_the_options(analyze: Run, bags: tuple[Path, Path]) -> None:
    result = analyze(bags[0], "--json", "--band", "1e-9", "--window", "0.01")
    base = json.loads(result.out)["base_pointing"]
    assert (base["band_deg"], base["window_s"]) == (1e-9, 0.01)
    assert base["half_cone_arcsec"]["within_band"] < 1.0
    assert 0.0 < base["half_cone_arcsec"]["jitter_rms"] < base["half_cone_arcsec"]["max"]
    refused = analyze(bags[0], "--band", "0")
    assert refused.code == 2


def test_each_number_of_a_replay_stands_in_the_line_of_its_own() -> None:
    report: dict[str, Any] = dict.fromkeys(COUNTS, 0)
    report |= {"unreadable": {"recorded": 0, "replayed": 0}, "ticks_per_s": None}
    for key, name in COUNTS.items():
        rows = dict(counts({**report, key: 17}))
        assert rows.pop(name) == "17"
        assert "17" not in rows.values()
    for key, words in (("recorded", "in the bag"), ("replayed", "now")):
        unreadable = {**report["unreadable"], key: 3}
        found = [row for row in counts({**report, "unreadable": unreadable}) if "read" in row[0]]
        assert found == [(f"commands {words} that cannot be read", "3")]
