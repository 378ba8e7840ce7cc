"""Flights from Python: objects in the place of names, ends as results, pages, several at a time."""

from __future__ import annotations

import builtins
import html
import json
import pickle
import re
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import space_robot_here
from paths import CONFIG
from scene_pages import Scene, plot_data

import space_robot
from space_robot import Campaign, FlownFlight, Scenario, fly_many
from space_robot.analysis import analyze
from space_robot.api.flight_page import unique_names
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import Signals, find_law
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.target import Target

NAMED: dict[str, Any] = {
    "controller": "tde_stc",
    "case": "3",
    "sensors": "fine",
    "actuators": "wheels",
    "seed": 3,
    "duration": 0.1,
}


def file_of(name: str, node: str) -> dict[str, Any]:
    content = yaml.safe_load((CONFIG / f"{name}.yaml").read_text())
    found: dict[str, Any] = content[f"{node}_node"]["ros__parameters"]
    return found


def same_bits(one: FlightLog, other: FlightLog) -> bool:
    pairs = [(one, other), (one.measured or one, other.measured or other)]
    return all(
        a.columns[k].tobytes() == b.columns[k].tobytes() for a, b in pairs for k in a.columns
    )


@pytest.fixture(scope="module")
def named() -> FlownFlight:
    return Scenario(**NAMED).fly()


@pytest.fixture(scope="module")
def paper_mission() -> dict[str, Any]:
    content = yaml.safe_load((CONFIG / "missions/paper.yaml").read_text())
    mission: dict[str, Any] = content["mission"]
    return mission


def tuned(signals: Signals) -> Any:
    """Computed torque with the gains of the tuned set."""
    u = signals.acceleration_desired + 1e4 * signals.error + 200.0 * signals.error_rate
    return signals.nominal.inertia @ u + signals.nominal.bias


def test_a_flown_flight_has_its_metrics_and_the_report_that_the_command_prints(
    named: FlownFlight,
) -> None:
    assert (named.outcome, named.reason, named.is_complete) == ("complete", "", True)
    assert named.check() is named
    assert named.metrics == analyze(named.log)["metrics"]
    assert "tde_stc" in repr(named)
    assert "<table>" in named._repr_html_()
    words = [f"--{key}={value}" for key, value in NAMED.items()]
    printed = space_robot_here("simulate", *words, "--json").stdout
    assert json.loads(printed) == json.loads(json.dumps(named.report()))


def test_objects_in_the_place_of_names_fly_the_same_bits(
    named: FlownFlight, paper_mission: dict[str, Any], tmp_path: Path
) -> None:
    """And a bag tells all of them."""
    scenario = Scenario(
        robot=Robot.from_yaml(CONFIG / "robots/paper.yaml"),
        mission=MissionSettings(
            joints_deg=paper_mission["start"]["joints_deg"],
            segments=[json.dumps(segment) for segment in paper_mission["segments"]],
            limits=paper_mission["limits"],
        ),
        controller=find_law("tde_stc"),
        gains=file_of("gains/paper/printed/tde_stc", "controller")["tde_stc"],
        case=EnvironmentSettings(**file_of("cases/3", "plant")),
        sensors=file_of("sensors/fine", "plant"),
        actuators=file_of("actuators/wheels", "plant"),
        seed=3,
        duration=0.1,
    )
    flight = scenario.fly(tmp_path / "bag")
    assert same_bits(flight.log, named.log)
    recorded = read_flight(tmp_path / "bag")
    assert same_bits(recorded, named.log)
    assert recorded.flight["case"] == recorded.flight["sensors"] == "given"
    assert analyze(recorded)["metrics"] == named.metrics


@pytest.mark.parametrize("own", [tuned, type("Own", (find_law("ctc"),), {"name": "own"})])
def test_robots_and_laws_of_nobody_fly(
    own: Any, paper_robot: Robot, paper_mission: dict[str, Any]
) -> None:
    heavy = replace(paper_robot, name="heavy", mass=1.1 * paper_robot.mass)
    gains = "default" if own is tuned else {"k_p": 1e4, "k_d": [200.0]}
    flight = Scenario(
        robot=heavy, mission=paper_mission, controller=own, gains=gains, duration=0.1
    ).fly()
    assert flight.report()["controller"] == own.__name__.lower()
    assert flight.metrics["attitude.rms"] < 1e-8
    assert flight.log.flight["robot"] == "heavy"
    assert Robot.from_dict(flight.log.flight["robot_file"]).mass[0] == heavy.mass[0]


def test_a_robot_without_files_needs_a_mission_and_gains(
    paper_robot: Robot, paper_mission: dict[str, Any]
) -> None:
    own = replace(paper_robot, name="mine")
    with pytest.raises(InputError, match="no mission of its own: choose one"):
        Scenario(robot=own).check()
    with pytest.raises(InputError, match="no gains of its own: give some"):
        Scenario(robot=own, mission=paper_mission).check()


def test_events_as_objects(paper_mission: dict[str, Any], tmp_path: Path) -> None:
    """In the options or in the mission, with a target that no file tells."""
    capture = Capture(0.02, Target(name="debris", mass=20.0, inertia=[1.0, 1, 1, 0, 0, 0]))
    given = [capture, Release(0.05)]
    flight = Scenario(events=given, duration=0.1).fly(tmp_path / "bag")
    assert flight.report()["events"] == ["capture@0.02:debris", "release@0.05"]
    mission = {**paper_mission, "events": given}
    assert same_bits(Scenario(mission=mission, duration=0.1).fly().log, flight.log)
    assert not same_bits(Scenario(duration=0.1).fly().log, flight.log)
    assert read_flight(tmp_path / "bag").flight["events"] == [str(event) for event in given]


def test_a_law_as_an_object_brings_gains_and_keeps_its_memory(named: FlownFlight) -> None:
    kind = find_law("tde_stc")
    section = file_of("gains/paper/printed/tde_stc", "controller")["tde_stc"]
    gains = {name: np.broadcast_to(np.array(row), 9).copy() for name, row in section.items()}
    law = kind(gains, 5e-4)
    before = law.memory_block.copy()
    assert same_bits(Scenario(**NAMED).replace(controller=law).fly().log, named.log)
    assert law.memory_block == before
    with pytest.raises(InputError, match="the flight has 9 and"):
        Scenario(controller=law, period=0.001).check()


def test_a_flight_that_diverged_or_was_not_answered_is_a_result(tmp_path: Path) -> None:
    flight = Scenario(controller=lambda signals: np.full(9, 1e7), duration=0.1).fly()
    assert flight.outcome == "diverged"
    assert flight.reason == "the flight diverged at tick 2 (t = 0.0010 s): 1.69e+04 rad/s"
    assert (flight.log.ticks, flight.ended_at_s) == (2, 0.001)
    report = flight.report()
    assert report["diverged"] == {"tick": 2, "time_s": 0.001}
    expected = {"outcome": "diverged", "planned_ticks": 200, "bag": None, "error": flight.reason}
    assert expected.items() <= report.items()
    assert "diverged" in repr(flight)
    with pytest.raises(DivergedError):
        flight.check()
    turned = {"plant": {"initial_quaternion": [0.0, 1, 0, 0]}}
    flight = Scenario(parameters=turned).fly(tmp_path / "bag")
    assert flight.outcome == "unanswered"
    assert (flight.log.ticks, flight.log.unanswered) == (1, 1)
    expected = {"diverged": None, "bag": str(tmp_path / "bag"), "error": flight.reason}
    assert expected.items() <= flight.report().items()


def test_metrics_without_a_log(named: FlownFlight, tmp_path: Path) -> None:
    times: list[float] = []
    flight = Scenario(**NAMED).fly(tmp_path / "bag", progress=times.append, keep_log=False)
    assert flight.report() == named.report()
    assert times[-1] == 0.1
    with pytest.raises(InputError, match="no log was kept"):
        _ = flight.log
    assert same_bits(read_flight(tmp_path / "bag"), named.log)


def test_figures_are_drawn_one_by_one_and_a_table_has_a_row_a_tick(
    named: FlownFlight, tmp_path: Path
) -> None:
    assert {"control_results", "pointing"} <= set(named.plots)
    assert named.plot("control_results", tmp_path / "all").axes
    assert {file.name for file in tmp_path.iterdir()} == {"all.png", "all.svg"}
    assert [*named.table["q_w"]] == [*named.log.quaternion[:, 0]]


def test_scenarios_are_values() -> None:
    scenario = Scenario(case="2", friction=False)
    other = scenario.replace(case=4, seed=7)
    assert scenario.given == {"case": "2", "friction": False}
    assert other.given == {"case": "4", "friction": False, "seed": 7}
    assert pickle.loads(pickle.dumps(other)) == other
    assert repr(other) == "Scenario(case='4', friction=False, seed=7)"
    assert set(space_robot.__all__) <= set(dir(space_robot))


@pytest.mark.filterwarnings("ignore:the start")
def test_each_is_the_flight_alone_in_the_given_order() -> None:
    """Several at a time: of two batches, one in plain Python, one that ends early."""
    common: dict[str, Any] = {"duration": 0.05, "sensors": "fine"}
    scenarios = [
        Scenario(**common),
        Scenario(**common, controller="ctc"),
        Scenario(**common, seed=3),
        Scenario(**common, controller=tuned),
        Scenario(**common, controller="ctc", case="3"),
        Scenario(**common, faults=["torque_scale@0:all=0.05"]),
    ]
    over: list[int] = []
    flights = fly_many(scenarios, progress=over.append)
    dropped = fly_many(scenarios, keep_log=False)
    assert over[-1] == len(flights) == 6
    for flight, other, scenario in zip(flights, dropped, scenarios, strict=True):
        alone = scenario.fly()
        assert flight.report() == alone.report()
        assert flight.outcome == alone.outcome
        assert same_bits(flight.log, alone.log)
        assert other.metrics == flight.metrics
    assert fly_many([]) == []


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Addresses that a browser was asked to open."""
    addresses: list[str] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda url: addresses.append(url) or True)
    return addresses


def test_the_page_is_written_and_opened(
    named: FlownFlight,
    opened: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page = named.view()
    assert (tmp_path / "tde_stc_view.html").read_text("utf-8") == page.html
    assert opened == [(tmp_path / "tde_stc_view.html").as_uri()]
    assert "wrote tde_stc_view.html (" in capsys.readouterr().err
    assert "MB" in repr(page)
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    named.view()
    assert capsys.readouterr().err.endswith("no browser available: open the page in one yourself\n")


def test_others_are_drawn_over_it(named: FlownFlight, opened: list[str], tmp_path: Path) -> None:
    others = [Scenario(controller="ctc", duration=0.1).fly(), named]
    page = named.view(*others, path="pages/laws.html", opens=False, rate=10.0, title="Laws")
    assert (tmp_path / "pages/laws.html").read_text("utf-8") == page.html
    assert not opened
    assert "<title>Laws</title>" in page.html
    roots = {name.split("/")[1] for name in Scene(page.html).names() if "base_link" in name}
    assert len(roots) == 3
    plots = plot_data(page.html)["plots"]
    assert any("ctc" in series["label"] for plot in plots for series in plot["series"])
    with pytest.raises(InputError, match="unknown plot 'moment'"):
        named.view(plots=["moment"])
    with pytest.raises(InputError, match=r"laws\.html"):
        named.view(path="pages/laws.html/page.html")
    assert unique_names(["ctc", "pd", "ctc", "ctc"]) == ["ctc", "pd", "ctc 2", "ctc 3"]


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process whose outputs are shown by Jupyter."""
    shell = type("ZMQInteractiveShell", (), {})
    monkeypatch.setattr(builtins, "get_ipython", shell, raising=False)


@pytest.mark.usefixtures("notebook")
def test_a_page_in_a_cell_is_small_and_needs_no_network(
    named: FlownFlight, opened: list[str], tmp_path: Path
) -> None:
    shown = named.view(rate=2.0)._repr_html_()
    assert (opened, [*tmp_path.iterdir()]) == ([], [])
    assert len(shown.encode()) < 2.5e6  # Jupyter's server passes on 1e6 bytes a second, over 3 s
    frame = re.fullmatch(r'<iframe srcdoc="([^"]*)" [^<>]*></iframe>', shown)
    assert frame
    document = html.unescape(frame[1])
    assert "<title>tde_stc</title>" in document
    assert not re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', document)
    assert Scene(document).duration > 0.0


def test_scenario_flight_campaign_and_robot_show_themselves_in_a_cell() -> None:
    scenario = Scenario(case="3", duration=0.5, seed=7)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", scenario._repr_html_())
    assert cells == ["case", "3", "1", "duration", "0.5", "the mission&#x27;s", "seed", "7", "0"]
    assert "complete" in scenario.fly()._repr_html_()
    campaign = Campaign.load("first")._repr_html_()
    assert "tde_stc, ctc, 20 runs, 40 flights" in campaign
    assert "attitude.max below 0.001 in 90 % of the cases, with 90 % confidence" in campaign
    dual_arm = find_robot("dual_arm")
    robot = dual_arm._repr_html_()
    assert f"{float(dual_arm.mass.sum()):g} kg" in robot
    assert all(f">{n}<" in robot for n in (*dual_arm.body_names, *dual_arm.all_joint_names))
