"""One resolved plan: what is set is flown, sent to the nodes and told in bags, any number of it."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run_program
from flights import planned
from matrix.scenarios import PLANS, Planned, in_root
from mcap.reader import make_reader
from numba.core import event
from paths import ROOT
from pydantic import BaseModel
from robots import PASSIVE_ROBOT
from rosbags.highlevel import AnyReader

from space_robot.flight.flight_messages import bag_remark, bag_size
from space_robot.flight.flown_log import empty_log
from space_robot.flight.graph.orchestrator import flight_parameters
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes import MODULES, software
from space_robot.scenario.faults import KINDS
from space_robot.scenario.node_settings import NODES, SCHEMAS
from space_robot_control.allocation.settings import assumed_actuators
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import Laws, split_gains
from space_robot_control.controller.law_choice import parse_swaps
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.guidance.mission import Mission, MissionNodeSettings
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.placements import RobotPoses, frame_names
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.message_accounting import noted_accounts
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Reference, RobotState
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_sim.environment.events import parse_events
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

OWN_FILES = {"plant_robot", "assumed_actuators"}
"""Options for which a graph writes files for its nodes."""


@pytest.fixture
def _in_root() -> Iterator[None]:
    with in_root():
        yield


@pytest.mark.usefixtures("_in_root")
@pytest.mark.parametrize(
    "plan", [plan for plan in PLANS.values() if not plan.options.keys() & OWN_FILES], ids=str
)
def test_all_that_is_made_of_a_plan_agrees(plan: Planned) -> None:
    """Settings and objects as the nodes make them of what they are sent; labels; `simulate`."""
    flight, parameters = plan.scenario.check(), plan.options.get("parameters", {})
    sent = json.loads(json.dumps(flight.scenario.parameters))
    for schema in SCHEMAS:
        for name in parameters.get(schema.node, {}):
            assert name in sent[schema.node]
    plant = PlantNodeSettings.resolve(sent["plant"])
    own, gains = split_gains(sent["controller"])
    controller = ControllerNodeSettings.resolve(own)
    mission = MissionNodeSettings.resolve(sent["mission"])
    assert plant == flight.plant_settings
    assert controller == flight.controller_settings
    assert mission == flight.mission_settings
    said = empty_log(flight).flight
    assert said == flight.description
    assert (said["case"], said["realtime"]) == (plant.case, plant.realtime)
    assert (said["gains"], said["seed"]) == (controller.gains, plant.fault_seed)
    assert said.get("faults", []) == [text for text in plant.faults if text]
    assert said.get("swaps", []) == [text for text in controller.swaps if text]
    assert said["command_latency_ticks"] == plant.command_latency_ticks
    assert said["friction"] is bool(plant.friction.coulomb or plant.friction.viscous)
    # as the nodes build them
    robot = find_robot(controller.robot)
    built = Laws(controller, len(robot.nominal.axis_names), gains)
    law = next(iter(built.values()))
    assert said["controller"] == law.name
    own = {name: row.tolist() for name, row in law.given_gains.items()}
    assert said["scenario"]["gains"].get(law.name, {}) == own
    theirs = Plant(find_robot(plant.robot), plant, plant.period)
    assert theirs.block.tobytes() == flight.plant.block.tobytes()
    assert theirs.command_delay_buffer.shape == flight.plant.command_delay_buffer.shape
    assert assumed_actuators(controller.actuators, robot) == flight.scenario.assumed_actuators
    actuators = assumed_actuators(controller.actuators, robot)
    loop = Controller.from_settings(robot, law, controller, actuators)
    assert loop.block.tobytes() == flight.controller.block.tobytes()
    assert law.gains_block.tobytes() == flight.controller.law.gains_block.tobytes()
    reference = Mission(robot, mission, mission.period).chunk(0, 100)
    np.testing.assert_array_equal(reference.joints, flight.mission.chunk(0, 100).joints)


def test_lists_go_to_the_nodes_as_declared(tmp_path: Path) -> None:
    """ROS takes no list of whole and decimal numbers."""
    parameters = {"plant": {"initial_quaternion": [0.9, 1, 0, 0], "case": 2}}
    flight = planned(duration=0.05, parameters=parameters)
    sent = flight_parameters(flight, tmp_path / "bag", tmp_path)["plant"]
    assert json.dumps(sent["initial_quaternion"]) == "[0.9, 1.0, 0.0, 0.0]"
    assert sent["case"] == "2"


# What a bag says of its flight


def test_a_bag_has_all_to_fly_its_flight_again(tmp_path: Path) -> None:
    plan = Scenario(
        controller="tde_smc",
        case="3",
        seed=7,
        friction=False,
        robot="seven_joint",
        duration=0.02,
        parameters={"plant": {"hold_ticks": 40}},
    )
    flight = Flight(resolve(plan))
    simulate(flight, tmp_path / "bag")
    said = read_flight(tmp_path / "bag").flight
    assert said == flight.description
    assert json.dumps(said) == json.dumps(Flight(resolve(plan)).description)
    assert (said["seed"], planned().description["seed"]) == (7, 0)
    assert tuple(said["scenario"]["parameters"]) == NODES == tuple(MODULES)
    robot = Robot.from_dict(said["robot_file"], where="the bag")
    np.testing.assert_array_equal(robot.inertia, flight.robot.inertia)


def test_a_large_bag_is_announced_with_its_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = planned(sensors="fine", duration=1.0)
    simulate(flight, tmp_path / "bag")
    written = sum(file.stat().st_size for file in (tmp_path / "bag").iterdir())
    assert bag_size(flight) == pytest.approx(written, rel=0.1)
    assert bag_remark(flight) == ""
    monkeypatch.setattr("space_robot.flight.flight_messages.LARGE_BAG", 1e5)
    assert bag_remark(flight) == f"the bag of 1 s will need about {written / 1e9:.1f} GB"


def test_versions_and_commit_are_those_installed() -> None:
    assert software.versions()["numpy"] == np.__version__
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    done = run_program(command)
    head = done.stdout.strip()
    known = (head, f"{head}-dirty") if done.returncode == 0 else (None,)
    assert software.commit() in known


# The robot that bags show to viewers


def shown_by(bag: Path) -> dict[str, list[tuple[int, Any]]]:
    """Messages to viewers with their log times, ns, read by rosbags."""
    shown: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with AnyReader([bag]) as reader:
        for connection, log_ns, data in reader.messages():
            if connection.topic in ("/tf", "/tf_static", "/robot_description"):
                message = reader.deserialize(data, connection.msgtype)
                shown[connection.topic].append((log_ns, message))
    return shown


def assert_poses_are_true(
    transforms: Sequence[Any], log_ns: int, log: FlightLog, poses: RobotPoses
) -> None:
    state = log.state(log.timebase.tick(log_ns))
    for transform, frame, pose in zip(transforms, poses.frames, poses.at(state), strict=True):
        assert (transform.header.frame_id, transform.child_frame_id) == tuple(frame)
        stamp = transform.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == log_ns
        t, q = transform.transform.translation, transform.transform.rotation
        assert [t.x, t.y, t.z, q.x, q.y, q.z, q.w] == pose.tolist()


NOISY = ["noise_joint_position@0:1e-3", "drop_state@0:0.1"]


@pytest.mark.parametrize(
    ("options", "ticks_apart"),
    [
        ({"duration": 0.2, "case": "3"}, 20),
        ({"duration": 0.105, "period": 0.0007, "robot": PASSIVE_ROBOT, "faults": NOISY}, 15),
    ],
    ids=["paper", "passive"],
)
def test_bags_show_where_the_robot_truly_is(
    options: dict[str, Any], ticks_apart: int, tmp_path: Path
) -> None:
    """At most 100 times a second, from the first tick on; what does not change once."""
    flight = planned(**options)
    log = simulate(flight, tmp_path / "bag")
    shown, step_ns = shown_by(tmp_path / "bag"), ticks_apart * flight.timebase.period_ns
    assert step_ns >= 10_000_000 > step_ns - flight.timebase.period_ns
    stamps = range(0, flight.timebase.stamp_ns(log.ticks), step_ns)
    assert [log_ns for log_ns, _ in shown["/tf"]] == list(stamps)
    poses = RobotPoses(flight.robot)
    for log_ns, message in shown["/tf"]:
        assert_poses_are_true(message.transforms, log_ns, log, poses)
    ((_, tools),) = shown["/tf_static"]
    assert [t.child_frame_id for t in tools.transforms] == list(frame_names(flight.robot).tools)
    assert len(shown["/robot_description"]) == 1


def test_what_holds_for_the_flight_is_latched_and_no_row_of_a_log(tmp_path: Path) -> None:
    """The description names the frames of the transforms, so viewers find the links: read by our
    own reader of URDF, it is the robot again. Players are told to latch it, as rosbag2 writes it;
    the recorder's account of the flight has each topic."""
    bag = tmp_path / "bag"
    simulate(planned(duration=0.1, robot=PASSIVE_ROBOT), bag)
    shown = shown_by(bag)
    (_, description), (_, poses) = shown["/robot_description"][0], shown["/tf"][0]
    (tmp_path / "robot.urdf").write_text(description.data, "utf-8")
    read = frame_names(Robot.from_urdf(tmp_path / "robot.urdf"))
    assert {t.child_frame_id for t in poses.transforms} == set(read.bodies)
    assert set(read_flight(bag).lost) == {t.full_name for t in topics.ALL}
    accounts = noted_accounts(open_bag(bag).custom_data())
    counts = {name: (accounts[name].received, accounts[name].missing) for name in accounts}
    assert counts["/tf"] == (10, 0)
    assert counts["/tf_static"] == counts["/robot_description"] == (1, 0)
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    offered = {c.topic: c.metadata["offered_qos_profiles"] for c in summary.channels.values()}
    latched = {name for name, profile in offered.items() if "transient_local" in profile}
    assert latched == {"/tf_static", "/robot_description", "/controller/law"}
    assert offered["/tf_static"].count("depth: 1\n") == 1


# Any number: of joints, for which nothing is compiled; in an option, a flight or one line

SWAPS = [f"{0.001 * k:g}:{law}" for k, law in enumerate(laws(), 1)]


class Compiled(event.Listener):  # type: ignore[misc]
    """Collects the names of functions that are compiled, not those loaded from disk."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def on_start(self, event: Any) -> None:
        self.names.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event: Any) -> None:
        pass


def fly(robot: str, **options: Any) -> None:
    """Fly a few ticks in one loop, and one step by step as the nodes do."""
    flight = planned(robot=robot, mission=robot, **options)
    simulate(flight)
    names, n = flight.controller.names, flight.robot.n
    states = StateCodec(names, flight.timebase)
    commands = CommandCodec(names.commanded, flight.timebase)
    state = RobotState.allocate(n)
    for topic, data in zip(states.topics, states.encode(state), strict=True):
        states.decode(topic, data, state)
    command = flight.build_controller(flight.law).update(state, Reference.at_rest(n))
    commands.decode(commands.encode(command), command)
    Flight(resolve(flight.scenario.options)).plant.step(command)


@pytest.mark.parametrize(
    "options",
    [
        {"swaps": SWAPS, "duration": 0.001 * (len(SWAPS) + 1)},
        {"sensors": "fine", "navigation": "filtered", "duration": 0.002},
        {"actuators": "none", "duration": 0.002},
    ],
    ids=["laws", "filter", "free_base"],
)
def test_another_number_of_joints_compiles_nothing(options: dict[str, Any]) -> None:
    fly("paper", **options)
    listener = Compiled()
    with event.install_listener("numba:compile", listener):
        fly("seven_joint", **options)
    assert not listener.names


def is_refused(options: dict[str, Any]) -> bool:
    """Tell if a flight of these options is refused, in one line; any other error is one here."""
    try:
        flight = Flight(resolve(validate(Scenario, options, "options")))
    except InputError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017
        return True
    assert 0 < flight.ticks < 2**63
    return False


def numbers_of(schema: type[BaseModel]) -> Iterator[tuple[str, bool]]:
    """Yield the name of each field that holds numbers, and whether it is a list of them."""
    for name, field in leaves(schema):
        text = str(field.annotation)
        if "float" in text or "int" in text:
            yield name, "list" in text


def test_any_parameter_and_option() -> None:
    for node in (PlantNodeSettings, ControllerNodeSettings, MissionNodeSettings):
        for name, is_list in numbers_of(node):
            for value in (1e308, 5e-324):
                is_refused({"parameters": {node.node: {name: [value] if is_list else value}}})
    for name, _ in numbers_of(Scenario):
        for value in (1e308, 5e-324, float("nan"), float("inf"), -1):
            is_refused({name: value})
    for name in ("case", "sensors", "actuators", "robot", "mission", "gains"):  # as a name
        assert is_refused({name: 10**400})


@pytest.mark.parametrize("period", [1e-5, 0.1])
@pytest.mark.parametrize(
    "time", ["1e308", "1e9", "1000000001", "1e400", "5e-324", "inf", "nan", "-1", "9" * 400, ""]
)
def test_any_time_is_a_tick_of_64_bits_or_refused(time: str, period: float) -> None:
    texts = [f"{kind}@{time}" for kind in KINDS]
    texts += [f"{kind}@1-{time}" for kind in KINDS]
    texts += [f"{name}:{a}" for name in texts for a in ("1", "1e308", "base=1", "5e-324")]
    for text in texts:
        try:
            faults = parse_faults([text], KINDS)
        except InputError:
            continue
        for fault in faults:
            assert 0 <= tick_from(fault.start_s, period) < 2**63
            assert fault.stop_s == float("inf") or tick_from(fault.stop_s, period) < 2**63
            if not (fault.kind.argument and fault.kind.argument.about):
                Schedule([fault], 0, period)
    for text in (f"capture@{time}:small_satellite", f"release@{time}:0.1"):
        try:
            events = parse_events(["capture@0:small_satellite", text][-1 - text.count("rel") :])
        except InputError:
            continue
        assert all(tick_from(event.time_s, period) < 2**63 for event in events)
    try:
        swaps = parse_swaps([f"{time}:ctc"], period)
    except InputError:
        return
    assert 0 <= swaps[0].tick < 2**63


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("events", "capture@{}:small_satellite"),
        ("faults", "drop_state@{}:0.1"),
        ("faults", "drop_state@0-{}"),
        ("swaps", "{}:ctc"),
    ],
)
def test_the_latest_time_is_a_flight_and_a_later_one_is_refused(key: str, text: str) -> None:
    assert is_refused({key: [text.format("1.1e9")]})
    assert is_refused({key: [text.format("1e308")]})
    assert key == "events" or not is_refused({key: [text.format("1e9")]})
