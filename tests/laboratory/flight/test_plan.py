"""One resolved plan: what is set by any way is flown, sent to the nodes, and told in bags."""

from __future__ import annotations

import json
import subprocess
from operator import or_
from pathlib import Path
from typing import Any

import numpy as np
from flights import planned
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from paths import ROOT

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
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

Parameters = dict[str, dict[str, Any]]


def flight_of(parameters: Parameters, **options: Any) -> Flight:
    return planned(duration=0.05, parameters=parameters, **options)


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


@settings(max_examples=25)
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
    assert tuple(said["parameters"]) == NODES == tuple(MODULES)
    robot = Robot.from_dict(said["robot_file"], where="the bag")
    np.testing.assert_array_equal(robot.inertia, flight.robot.inertia)


def test_versions_and_commit_are_those_installed() -> None:
    assert software.versions()["numpy"] == np.__version__
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True)
    head = done.stdout.strip()
    known = (head, f"{head}-dirty") if done.returncode == 0 else (None,)
    assert software.commit() in known
