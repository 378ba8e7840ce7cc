"""The real graph, of four processes or one: flights as in this process, and such that end early."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import yaml
from flights import Flown, PausedFlight, forked_space_robot, planned, simulated, space_robot_here
from matrix.scenarios import difference
from mcap.reader import make_reader
from paths import CONFIG
from robots import driven_paper
from rosbags.rosbag2 import Reader

from space_robot.analysis import analyze
from space_robot.flight.graph import node_services
from space_robot.flight.graph.node_services import set_parameters
from space_robot.flight.graph.orchestrator import launched_parameters
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.wire.definitions import jazzy
from space_robot_sim.plant.settings import PlantNodeSettings

pytest.importorskip("rclpy")

NODES = {"recorder_node", "mission_node", "controller_node", "plant_node"}
TICKS = 600
SWAPS = ["0.1:ctc", "0.2:tde_smc"]
FAULTS = ["noise_gyro@0.05-0.2:1e-6", "drive_bias@0.1:base_y=0.001", "nan_state@0.2-0.25:0.1"]
WORDS = (
    *("--case", "3", "--sensors", "fine", "--seed", "5", "--duration", "0.3"),
    *(word for text in SWAPS for word in ("--swap", text)),
    *(word for text in FAULTS for word in ("--fault", text)),
)


@pytest.fixture(scope="module")
def graph(fly: Callable[..., Flown]) -> Flown:
    """A flight of four processes with sensors, swaps, and faults of drives and messages."""
    return fly(*WORDS)


def test_the_graph_reports_what_one_process_does(graph: Flown) -> None:
    options = {"case": "3", "sensors": "fine", "seed": 5, "duration": 0.3}
    log = simulated(**options, swaps=SWAPS, faults=FAULTS)
    assert difference(read_flight(graph.bag), log, {"telemetry"}) == ""
    ours = json.loads(json.dumps(analyze(log)), parse_constant=lambda _: None)
    reported = graph.bag_report
    result = space_robot_here("analyze", str(graph.bag), "--json")
    assert json.loads(result.stdout) == reported
    for report in (ours, reported):
        for key in ("lost", "unavailable"):  # of the clock, and of messages
            report.pop(key)
        for name in [name for name in report["metrics"] if name.startswith("latency.")]:
            del report["metrics"][name]
    assert ours == reported


def test_the_report_tells_of_all_nodes_and_nothing_is_lost(graph: Flown) -> None:
    report, told = graph.report, graph.report["graph"]
    assert set(told["nodes"]) == NODES
    assert told["nodes"]["plant_node"]["tick"] == str(TICKS)
    rejected = int(told["nodes"]["controller_node"]["rejected: state not finite"])
    assert 0 < rejected < 20
    assert (told["failures"], told["warnings"], told["restarts"]) == ([], [], 0)
    assert report["lost"] == {topic.full_name: 0 for topic in topics.ALL}
    assert report["ticks"] == TICKS
    with Reader(graph.bag) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
    assert counts["/joint_states"] == counts["/base/state"] == counts["/command"] == TICKS
    assert counts["/clock"] == counts["/controller/telemetry"] == TICKS // 20


def test_commands_answer_the_state_of_their_stamp_and_are_sent_after_it(graph: Flown) -> None:
    """Log times are simulated ones, publish times the senders'."""
    (file,) = graph.bag.glob("*.mcap")
    sent: dict[str, dict[int, int]] = {}
    commands = {}
    with file.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            sent.setdefault(channel.topic, {})[message.log_time] = message.publish_time
            if channel.topic == "/command":
                read = jazzy().deserialize_cdr(message.data, "sensor_msgs/msg/JointState")
                assert read.name[:3] == ["base_x", "base_y", "base_z"]
                commands[message.log_time // 500_000] = read.effort
    states, answers = sent["/base/state"], sent["/command"]
    assert states.keys() == answers.keys() == {tick * 500_000 for tick in range(TICKS)}
    assert min(answers[stamp] - states[stamp] for stamp in states) > 0
    for times in (states, answers):
        assert list(times.values()) == sorted(times.values())
        assert abs(max(times.values()) - time.time_ns()) < 3600e9  # since 1970
    log = read_flight(graph.bag)
    asked = np.array([commands[k] for k in range(200)])  # as long as no drive fails
    np.testing.assert_array_equal(log.as_measured().applied_torque[1:201], asked)


def test_by_the_wall_clock_every_tick_is_flown(fly: Callable[..., Flown]) -> None:
    """Here by nodes in one process, into a bag of several files."""
    words = ("--composed", "--compression", "zstd", "--split-size", "66K")
    flown = fly("--duration", "0.5", "--realtime", *words)
    assert len(list(flown.bag.glob("*.mcap"))) > 1
    assert flown.report["ticks"] == 1000
    assert not any(flown.report["lost"].values())
    assert 0 <= flown.report["unanswered_ticks"] < 1000


def test_launched_nodes_get_files_of_their_own(tmp_path: Path) -> None:
    """Here of the paper's robot with gears, and of wheels with rotors that are heavier."""
    robot, wheels = tmp_path / "geared.yaml", tmp_path / "heavier.yaml"
    robot.write_text(yaml.safe_dump(driven_paper()), "utf-8")
    content = yaml.safe_load((CONFIG / "actuators" / "wheels.yaml").read_text("utf-8"))
    of_wheels = content["plant_node"]["ros__parameters"]["wheels"]
    of_wheels["rotor_inertia"] = [1.1 * value for value in of_wheels["rotor_inertia"]]
    wheels.write_text(yaml.safe_dump(content), "utf-8")
    options = {"actuators": "wheels", "assumed_actuators": str(wheels), "duration": 0.2}
    flight = planned(plant_robot=str(robot), **options)
    of_ros = {"mission": {"use_sim_time": True}}
    file = launched_parameters(flight, tmp_path / "bag", False, tmp_path, of_ros)
    launched = yaml.safe_load(file.read_text("utf-8"))
    plant, controller, mission = (
        launched[f"/**/{node}_node"]["ros__parameters"]
        for node in ("plant", "controller", "mission")
    )
    assert (plant["autostart"], mission["autostart"]) == (False, False)
    assert mission["use_sim_time"] is True
    assert "use_sim_time" not in plant
    assert find_robot(plant["robot"]).geared_names == ("joint2", "joint3", "joint5")
    assert find_robot(controller["robot"]).geared_names == ()
    assumed = yaml.safe_load(Path(controller["actuators"]).read_text())
    expected = flight.scenario.assumed_actuators.wheels.rotor_inertia
    assert assumed["plant_node"]["ros__parameters"]["wheels"]["rotor_inertia"] == expected
    # a plant that is told all this accepts it
    known = {name for name, _ in leaves(PlantNodeSettings)}
    PlantNodeSettings.resolve({key: plant[key] for key in known & plant.keys()})


# Flights that do not go to their end: no hang, no process, a readable bag, one clear line

TIMEOUT_S = 240.0


class Begun(PausedFlight):
    """A flight that is paused after 100 ticks, and its nodes."""

    def __init__(self, bag: Path, domain: int, *options: str) -> None:
        super().__init__(bag, domain, *options)
        self.sim("step", "--ticks", "100")
        self.processes = self.nodes()
        assert len(self.processes) == (1 if "--composed" in options else 4)

    def end(self) -> tuple[int, str, str]:
        """No process is left, and no traceback is printed."""
        code, output, errors = super().end()
        assert "Traceback" not in errors
        assert not any(node.is_running() for node in self.processes.values())
        return code, output, errors

    def closed_bag(self) -> int:
        """The ticks in it: those of 0 to 100 have been measured and answered."""
        log = read_flight(self.bag)
        assert (log.unfinished, log.damage) == ("", ())
        assert not any(log.lost.values())
        return log.ticks


@pytest.mark.parametrize(
    ("number", "options"), [(signal.SIGINT, ()), (signal.SIGTERM, ("--composed",))]
)
def test_interrupted_flight_leaves_a_closed_bag_and_no_process(
    tmp_path: Path, free_domain: int, number: signal.Signals, options: tuple[str, ...]
) -> None:
    """In flight, and paused."""
    flight = Begun(tmp_path / "bag", free_domain, *options)
    if is_paused := bool(options):
        assert "already paused at tick 100" in flight.sim("pause")
    else:
        flight.sim("resume")
        assert "plant_node cannot step: it is not paused" in flight.sim("step", code=1)
    flight.process.send_signal(number)
    code, _, errors = flight.end()
    assert code == 128 + number
    assert "stopped at" in errors
    assert (flight.closed_bag() == 101) is is_paused


def test_a_mission_that_is_killed_is_not_waited_for_and_a_dead_controller_ends_the_flight(
    tmp_path: Path, free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = Begun(tmp_path / "bag", free_domain)

    def killed_before(*arguments: Any) -> None:
        os.kill(flight.processes["mission"].pid, signal.SIGKILL)
        set_parameters(*arguments)

    monkeypatch.setattr(node_services, "set_parameters", killed_before)
    with pytest.raises(FlightError, match="mission_node has gone"):
        node_services.go_to("{hold: 1}", free_domain, "")
    flight.processes["controller"].kill()
    code, _, errors = flight.end()
    assert code == 1
    assert "controller ended by signal 9" in errors
    assert flight.closed_bag() == 101


def test_recorder_without_room_costs_the_bag_and_the_exit_code(
    tmp_path: Path, free_domain: int
) -> None:
    """Not the flight: it is flown to its end."""
    flight = Begun(tmp_path / "bag", free_domain, "--duration", "0.5", "--json")
    resource.prlimit(flight.processes["recorder"].pid, resource.RLIMIT_FSIZE, (300_000, 300_000))
    flight.sim("resume")
    code, output, errors = flight.end()
    assert code == 1
    assert "could not be written to the end (File too large)" in errors
    assert "recorder_node: not recording" in errors
    report = json.loads(output)
    assert report["unfinished"]
    assert 0 < report["ticks"] < 1_000
    assert int(report["graph"]["nodes"]["plant_node"]["tick"]) == 1_000


def test_recorder_without_its_folder_says_so(tmp_path: Path, free_domain: int) -> None:
    flight = Begun(tmp_path / "bag", free_domain, "--duration", "0.2")
    shutil.rmtree(flight.bag)
    flight.sim("resume")
    code, _, errors = flight.end()
    assert code != 0
    assert "removed or moved" in errors
    assert not flight.bag.exists()


def test_nodes_of_a_killed_command_close_the_bag_and_the_next_flight_has_the_domain(
    tmp_path: Path, free_domain: int
) -> None:
    flight = Begun(tmp_path / "bag", free_domain)
    flight.process.kill()
    flight.process.wait()
    # at once, while they are still ending
    words = ("--duration", "0.1", "--domain", str(free_domain), "--bag", str(tmp_path / "next"))
    following = space_robot_here("fly", "--composed", *words)
    assert following.returncode == 0, following.stderr
    assert not psutil.wait_procs(flight.processes.values(), TIMEOUT_S)[1]
    assert flight.closed_bag() == 101


def test_nodes_of_a_command_killed_at_their_start_end(tmp_path: Path) -> None:
    """Before any Python of theirs runs."""
    flight = forked_space_robot("fly", "--bag", str(tmp_path / "bag"))
    command, until = psutil.Process(flight.pid), time.monotonic() + TIMEOUT_S
    while len(nodes := command.children(recursive=True)) < 5:  # with their server
        assert time.monotonic() < until
    flight.kill()
    flight.wait()
    assert not psutil.wait_procs(nodes, TIMEOUT_S)[1]
