"""One resolved plan: what is set by any way is flown, sent to the nodes, and told in bags."""

from __future__ import annotations

import json
import shutil
import subprocess
from operator import or_
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import planned
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from paths import ROOT

from space_robot.analysis import analyze
from space_robot.flight.bag_path import default_bag
from space_robot.flight.flown_log import empty_log
from space_robot.flight.graph.orchestrator import flight_parameters
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes import software
from space_robot.processes.node_modules import MODULES
from space_robot.scenario.node_settings import NODES, NOT_TO_BE_SET, SCHEMAS
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import FRACTIONS, build_laws, gain_files, split_gains
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.guidance.mission import Mission
from space_robot_control.guidance.settings import MissionNodeSettings
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.message_accounting import topics_with_allowed_gaps
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.directory import config_directory
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

Parameters = dict[str, dict[str, Any]]


def heavy_robot(folder: Path) -> Path:
    """The paper's robot with a heavier last link."""
    content = yaml.safe_load((config_directory() / "robots" / "paper.yaml").read_text())
    content["robot"]["links"][-1]["mass"] *= 4.0
    content["robot"]["name"] = "heavy"
    path = folder / "heavy.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def flight_of(parameters: Parameters, **options: Any) -> Flight:
    return planned(duration=0.05, parameters=parameters, **options)


def test_a_parameter_is_the_same_as_its_option() -> None:
    """Settings, labels and objects; the plan alone keeps how it was said."""
    pairs: list[tuple[Parameters, dict[str, Any]]] = [
        ({"controller": {"controller": "ctc"}}, {"controller": "ctc"}),
        ({"controller": {"gains": "tuned"}}, {"gains": "tuned"}),
        ({"controller": {"navigation": "filtered"}}, {"navigation": "filtered"}),
        ({"controller": {"swaps": ["0.01:ctc"]}}, {"swaps": ["0.01:ctc"]}),
        ({"plant": {"case": 3}}, {"case": "3"}),
        ({"plant": {"realtime": True}}, {"realtime": True}),
        (
            {"plant": {"faults": ["nan_state@0-1"], "fault_seed": 7}},
            {"faults": ["nan_state@0-1"], "seed": 7},
        ),
        ({"plant": {"friction": {"coulomb": 0.0, "viscous": 0}}}, {"friction": False}),
        ({"plant": {"command_latency_ticks": 2}}, {"command_latency_ticks": 2}),
        ({"recorder": {"compression": "zstd"}}, {"compression": "zstd"}),
    ]
    for parameters, options in pairs:
        one, other = flight_of(parameters), flight_of({}, **options)
        assert one.description == other.description, options
        assert one.plant_settings == other.plant_settings
        assert one.controller_settings == other.controller_settings
        assert one.scenario.recorder == other.scenario.recorder
        assert topics_with_allowed_gaps(one.description) == topics_with_allowed_gaps(
            other.description
        )
        assert (
            default_bag(one).name.partition("_2")[0] == (default_bag(other).name.partition("_2")[0])
        )


def test_gains_are_parameters_as_at_the_node() -> None:
    flight = flight_of({"controller": {"tde_stc.k_1": [0.5], "tde_smc": {"g": [1]}}})
    assert flight.scenario.gains_used["k_1"] == [0.5] * 9
    assert flight.scenario.parameters["controller"]["tde_stc.k_1"] == [0.5] * 9
    assert flight.scenario.parameters["controller"]["tde_smc.g"] == [1.0] * 9
    plain = simulate(flight_of({}))
    assert not np.array_equal(simulate(flight).applied_torque, plain.applied_torque)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"plant": {"ticks": 5}}, "plant.ticks cannot be set: use --duration"),
        ({"recorder": {"bag": "b"}}, "recorder.bag cannot be set: use --bag"),
        ({"recorder": {"flight": "{}"}}, "recorder.flight cannot be set"),
        ({"recorder": {"robot": "seven_joint"}}, "recorder.robot cannot be set: use --robot"),
        ({"plant": {"wait_for": ["x"]}}, "plant.wait_for cannot be set"),
        ({"mission": {"autostart": False}}, "mission.autostart cannot be set"),
        ({"plant": {"hold_tick": 5}}, "hold_tick: unknown key, got 5: did you mean hold_ticks?"),
        ({"controller": {"tde_stc.k_9": [1.0]}}, "unknown gain of tde_stc 'k_9'"),
        ({"controller": {"pid.k_1": [1.0]}}, "unknown law 'pid' in controller parameters"),
        ({"plnt": {"hold_ticks": 5}}, "unknown node 'plnt'"),
        ({"controller": {"period": 0.001}}, "controller.period cannot be set: use --period"),
        (
            {"plant": {"robot": "seven_joint", "mission": "seven_joint"}},
            "the robots of plant and controller must have the same joints",
        ),
        (
            {"mission": {"robot": "seven_joint"}},
            "the robots of plant and mission must have the same joints",
        ),
        ({"controller": {"swaps": ["1:pid"]}}, "unknown controller 'pid' of swaps"),
        ({"plant": {"friction": 1.0, "friction.viscous": 1.0}}, "given as a value, and as a group"),
    ],
)
def test_what_cannot_be_set_is_refused(parameters: Parameters, said: str) -> None:
    with pytest.raises(InputError) as caught:
        flight_of(parameters)
    assert said in str(caught.value)


def test_every_parameter_that_is_refused_is_one() -> None:
    known = {f"{schema.node}.{name}" for schema in SCHEMAS for name, _ in leaves(schema)}
    known |= {f"{node}.autostart" for node in NODES}
    assert set(NOT_TO_BE_SET) <= known


def test_one_period_for_all_is_flown(tmp_path: Path) -> None:
    flight = planned(duration=0.05, period=0.001, substeps=4)
    assert (flight.period, flight.ticks, flight.plant.memory.substeps) == (0.001, 50, 4)
    assert flight.description["period"] == 0.001
    assert all(flight.scenario.parameters[node]["period"] == 0.001 for node in NODES)
    case = tmp_path / "slow.yaml"
    case.write_text("plant_node: {ros__parameters: {period: 0.001}}\n")
    with pytest.raises(InputError, match=r"got plant 0\.001, controller"):
        planned(case=str(case))
    assert planned(case=str(case), period=0.0005, duration=1.0).ticks == 2000
    assert planned(duration=1e6).ticks == 2 * 10**9
    with pytest.raises(InputError, match="duration must be at most 100000 s"):
        planned(duration=1e6, period=1e-5)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"plant": {"realtime": True}}, "realtime: that needs the graph of nodes: use `fly`"),
        ({"controller": {"fifo_priority": 5}}, "fifo_priority: that needs the graph"),
    ],
)
def test_simulate_refuses_what_needs_the_graph(parameters: Parameters, said: str) -> None:
    with pytest.raises(InputError, match=said):
        simulate(flight_of(parameters))


def test_plant_and_controller_may_have_robots_of_their_own(tmp_path: Path) -> None:
    """A heavy plant under a nominal controller, and a law with a model whose robot is heavier."""
    path, nominal = heavy_robot(tmp_path), flight_of({})
    flight = flight_of({"plant": {"robot": str(path), "mission": "paper"}})
    log = simulate(flight)
    assert not np.array_equal(log.applied_torque, simulate(nominal).applied_torque)
    said = flight.description
    assert (said["robot"], said["controller_robot"]) == ("heavy", "paper")
    assert Robot.from_dict(said["robot_file"]).mass[-1] == flight.plant.robot.mass[-1]
    assert said["controller_robot_file"] == nominal.description["robot_file"]
    assert "controller_robot_file" not in nominal.description
    assert analyze(log)["robot"] == "heavy"
    plan: dict[str, Any] = {"controller": "ctc", "gains": "tuned"}
    tuned = str(config_directory() / "gains" / "paper" / "tuned")
    wrong = flight_of({"controller": {"robot": str(path), "gains": tuned}}, **plan)
    torque = simulate(wrong).applied_torque
    assert not np.array_equal(torque, simulate(flight_of({}, **plan)).applied_torque)
    assert wrong.plant.robot.name == "paper"
    assert wrong.description["controller_robot"] == "heavy"


def _numbers(low: float, high: float) -> st.SearchStrategy[Any]:
    """Decimal and whole ones, as a user may write them."""
    first, last = int(np.ceil(low)), int(np.floor(high))
    return st.floats(low, high) | (st.integers(first, last) if first <= last else st.nothing())


def _vector(length: int, low: float, high: float) -> st.SearchStrategy[Any]:
    return st.lists(_numbers(low, high), min_size=length, max_size=length)


_VECTORS: dict[tuple[int, float, float], str] = {
    (4, 0.1, 3.0): "initial_quaternion base_quaternion",
    (3, 0.1, 3.0): "star_tracker.boresight gyro.initial_bias gyro.scale_factor_error "
    "assumed_orbit.target.position assumed_orbit.target.velocity base_rate_deg_s "
    "initial_rate_deg_s magnetism.residual_dipole",
    (1, 0.0, 3.0): "drive_scale drive_bias drive_lag drive_step drive_dead_band echo_scale "
    "echo_bias",
    (1, 0.01, 1.0): "wheels.rotor_inertia wheels.max_torque wheels.coulomb wheels.viscous "
    "thrusters.force thrusters.shortest_pulse thrusters.delay thrusters.specific_impulse",
    (1, 0.5, 5.0): "magnetic_torquers.max_dipole",
    (4, 2, 30): "wheels.max_momentum",
    (4, -1.0, 1.0): "wheels.initial_speed",
    (6, -90.0, 90.0): "initial_joints_deg",
    (18, -90.0, 90.0): "waypoints_deg",
}
_RANGES: dict[tuple[float, float], str] = {
    (4e5, 1e9): "orbital_elements.height assumed_orbit.orbital_elements.height",
    (0.0, 0.05): "orbital_elements.eccentricity assumed_orbit.orbital_elements.eccentricity",
    # wheels can give what these ask for
    (0.0, 1e-11): "atmosphere.density",
    (0.0, 1e-5): "sunlight.pressure",
    (0.0, 1e-4): "magnetism.strength",
    (0.0, 0.03): "star_tracker.delay",
    (1.0, 5.0): "allocation.schmitt_on",
    (-1.0, 0.5): "allocation.schmitt_off",
    (0.7, 1.0): "allocation.unload_above",
    (0.0, 0.2): "allocation.unload_to",
}
_CHOICES: dict[str, list[Any]] = {
    "robot": ["paper"],
    "mission": ["", "paper"],
    "case": ["1", 2, "4-1"],
    "faults": [[], ["nan_state@1"], ["drop_command@2-3:0.5"]],
    "events": [[""], ["capture@0.1:small_satellite"]],
    "segments": [[""], ["{hold: 1}"]],
    "payload.inertia": [[1, 1, 1.5, 0, 0, 0]],
    "star_tracker.rate": [0, 2.5, 100],
    "orbit": ["iss", "sso_700"],
    "assumed_orbit.target.name": [""],
    "base_point": [""],
    "torque_echo": ["command", "given"],
    "actuators": ["wheels"],
    "base_actuation": ["hardware"],
    "base_torque_limit": [0],
    "wheels.axes": [[1, 0, 0, 0, 1.5, 0, 0, 0, 1, 1, 1, 1]],
    "magnetic_torquers.axes": [[0.0]],
    "thrusters.positions": [[0.0]],
    "thrusters.directions": [[0.0]],
    "allocation.dump": ["all", "none", "thrusters", "magnetic"],
    "allocation.wheels": ["pseudo_inverse", "least_largest"],
    "allocation.modulation": ["pwm", "sigma_delta", "schmitt"],
    "waypoint_times": [[0, 1.5, 3]],
    "controller_code": ["python", "c"],
    "shadow": ["none", "c"],
    "disturbance.table": ["", '{"time":[0,1],"base_force_x":[0,2.5]}'],
    "compression": ["none", "lz4", "zstd"],
    "split_size": [0, 100_000, "2M"],
    "sensors": ["ideal", "white_l1"],
    "navigation_sensors": ["ideal", "coarse"],
    "navigation": ["direct", "filtered"],
    "navigation_filter.tracker_boresight": [[0, 0, 0], [1, 0, 2.5]],
}
_SPECIAL = {
    **{name: _vector(*key) for key, names in _VECTORS.items() for name in names.split()},
    **{name: _numbers(*key) for key, names in _RANGES.items() for name in names.split()},
    **{name: st.sampled_from(values) for name, values in _CHOICES.items()},
}
_NOT_ALONE = {"waypoint_times", "waypoints_deg"}
_OF_ORBIT = {name for name, _ in leaves(OrbitSettings)}
"""What can be set only for a robot in an orbit."""


def _values(name: str, field: Any) -> st.SearchStrategy[Any]:
    if name in _SPECIAL:
        return _SPECIAL[name]
    bounds = {k: getattr(m, k) for m in field.metadata for k in ("ge", "le") if hasattr(m, k)}
    low, high = bounds.get("ge"), bounds.get("le")
    if field.annotation is bool:
        return st.booleans()
    if field.annotation is int:
        return st.integers(low, high)
    if field.annotation is float:
        return _numbers(low, high)
    return _vector(2, 0.0, 5.0)  # frequencies


def _any_parameters() -> st.SearchStrategy[Parameters]:
    """Of all laws, or of those that the printed set has."""
    of_paper = sorted(gain_files("paper", "printed"))
    return _parameters(sorted(laws()), ["default", "tuned"]) | _parameters(of_paper, ["printed"])


def _of_laws(names: list[str], sets: list[str]) -> dict[str, st.SearchStrategy[Any]]:
    law = st.sampled_from(names)
    return {
        "controller": law,
        "gains": st.sampled_from(sets),
        "swaps": st.lists(st.builds("0.0{}:{}".format, st.integers(1, 9), law), max_size=1),
        **{
            f"{name}.{gain}": _vector(9, 1e-3, 0.9 if gain in FRACTIONS else 1e3)
            for name in names
            for gain in laws()[name].gain_descriptions()
        },
    }


def _parameters(names: list[str], sets: list[str]) -> st.SearchStrategy[Parameters]:
    nodes = {}
    for schema in SCHEMAS:
        allowed = {
            name: _values(name, field)
            for name, field in leaves(schema)
            if name not in _NOT_ALONE and f"{schema.node}.{name}" not in NOT_TO_BE_SET
        }
        allowed |= _of_laws(names, sets) if schema is ControllerNodeSettings else {}
        of_orbit = {name: allowed.pop(name) for name in _OF_ORBIT & allowed.keys()}
        orbit = {"orbit": allowed.pop("orbit")} if of_orbit else {}
        nodes[schema.node] = st.fixed_dictionaries({}, optional=allowed)
        if of_orbit:
            in_orbit = st.just({}) | st.fixed_dictionaries(orbit, optional=of_orbit)
            nodes[schema.node] = st.builds(or_, nodes[schema.node], in_orbit)
    return st.fixed_dictionaries({}, optional=nodes)


@settings(max_examples=40)
@given(_any_parameters())
def test_all_that_is_made_of_a_plan_agrees(parameters: Parameters) -> None:
    """Settings and objects as the nodes make them of what they are sent; labels; `simulate`."""
    try:
        flight = flight_of(parameters, actuators="wheels")
    except InputError as error:  # wheels that cannot hold the mission
        assume("of what the actuators" not in str(error))
        raise
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
    assert said["parameters"] == sent
    assert (said["case"], said["realtime"]) == (plant.case, plant.realtime)
    assert (said["gains"], said["seed"]) == (controller.gains, plant.fault_seed)
    assert said.get("faults", []) == [text for text in plant.faults if text]
    assert said.get("swaps", []) == [text for text in controller.swaps if text]
    assert said["command_latency_ticks"] == plant.command_latency_ticks
    assert said["friction"] is bool(plant.friction.coulomb or plant.friction.viscous)
    # as the nodes build them
    built = build_laws(controller, 9, gains)
    law = next(iter(built.values()))
    assert said["controller"] == law.name
    assert said["gains_used"] == {name: row.tolist() for name, row in law.gain_values.items()}
    theirs = Plant(Robot.from_yaml(named_file("robots", plant.robot)), plant, plant.period)
    assert theirs.block.tobytes() == flight.plant.block.tobytes()
    assert theirs.command_delay_buffer.shape == flight.plant.command_delay_buffer.shape
    robot = Robot.from_yaml(named_file("robots", controller.robot))
    assert assumed_actuators(controller.actuators, robot) == flight.scenario.assumed_actuators
    loop = Controller(
        robot,
        law,
        controller.period,
        controller.acceleration_filter_hz,
        controller.filter_settings,
        assumed_actuators(controller.actuators, robot),
        controller.allocation,
    )
    assert loop.block.tobytes() == flight.controller.block.tobytes()
    assert law.gains_block.tobytes() == flight.controller.law.gains_block.tobytes()
    reference = Mission(robot, mission, mission.period).chunk(0, 100)
    np.testing.assert_array_equal(reference.joints, flight.mission.chunk(0, 100).joints)


def test_lists_go_to_the_nodes_as_declared(tmp_path: Path) -> None:
    """ROS takes no list of whole and decimal numbers."""
    flight = flight_of({"plant": {"initial_quaternion": [0.9, 1, 0, 0], "case": 2}})
    sent = flight_parameters(flight, tmp_path / "bag")["plant"]
    assert json.dumps(sent["initial_quaternion"]) == "[0.9, 1.0, 0.0, 0.0]"
    assert sent["case"] == "2"


# What a bag says of its flight


def test_a_bag_has_all_to_fly_its_flight_again(tmp_path: Path) -> None:
    plan = FlightPlan(
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
    robot = Robot.from_dict(said["robot_file"], where="the bag")
    np.testing.assert_array_equal(robot.inertia, flight.robot.inertia)
    assert tuple(said["parameters"]) == NODES == tuple(MODULES)
    told = said["parameters"]
    assert PlantNodeSettings.resolve(told["plant"]) == flight.plant_settings
    own, gains = split_gains(told["controller"])
    assert ControllerNodeSettings.resolve(own) == flight.controller_settings
    assert gains[said["controller"]] == said["gains_used"]


def test_robot_is_told_though_its_file_is_gone(tmp_path: Path) -> None:
    file = Path(shutil.copy(config_directory() / "robots" / "paper.yaml", tmp_path))
    flight = planned(robot=str(file))
    file.unlink()
    robot = Robot.from_dict(flight.description["robot_file"])
    np.testing.assert_array_equal(robot.com, flight.robot.com)


def test_versions_and_commit_are_those_installed() -> None:
    assert software.versions()["numpy"] == np.__version__
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True)
    head = done.stdout.strip()
    known = (head, f"{head}-dirty") if done.returncode == 0 else (None,)
    assert software.commit() in known
