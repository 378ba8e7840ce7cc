"""The real graph: processes, DDS, a bag; against the in-process flight and physics.

One flight of each kind has its four processes; the others are composed, which gives the same bits
(`test_composed`) in half the time.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conservation import kinetic_energy, momentum
from flights import Flown, space_robot_here
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.wire.definitions import jazzy

SHORT = ("--duration", "0.5")
LONG = ("--duration", "3")
COMPOSED = "--composed"
STATE_COLUMNS = (
    "base_position",
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "reference_joints",
    "reference_base",
)


@pytest.mark.parametrize(("law", "how"), [("ctc", (COMPOSED,)), ("tde_stc", ())])
def test_graph_and_in_process_flights_agree_to_the_last_bit(
    fly: Callable[..., Flown], law: str, how: tuple[str, ...]
) -> None:
    flown = fly("--controller", law, "--case", "3", *SHORT, *how)
    log = simulate(Flight(resolve(FlightPlan(controller=law, case="3", duration=0.5))))
    recorded = read_flight(flown.bag)
    for column in STATE_COLUMNS:
        np.testing.assert_array_equal(getattr(recorded, column), getattr(log, column), column)
    here, there = json.loads(json.dumps(analyze(log))), flown.bag_report
    for key in ("latency", "unavailable"):  # of the wall clock; the simulated flight has none
        assert here.pop(key) != there.pop(key)
    assert here == there


def test_all_laws_are_swapped_at_the_same_ticks_in_both(
    fly: Callable[..., Flown], tmp_path: Path
) -> None:
    swaps = ["0.1:ctc", "0.2:ctc_smc", "0.3:tde_smc", "0.4:tde_tsmc"]
    flown = fly(*SHORT, *(word for swap in swaps for word in ("--swap", swap)), COMPOSED)
    log = simulate(Flight(resolve(FlightPlan(swaps=swaps, duration=0.5))), tmp_path / "bag")
    recorded = read_flight(flown.bag)
    for column in STATE_COLUMNS:
        np.testing.assert_array_equal(getattr(recorded, column), getattr(log, column), column)
    assert recorded.laws == log.laws == read_flight(tmp_path / "bag").laws
    in_order = ["tde_stc", "ctc", "ctc_smc", "tde_smc", "tde_tsmc"]
    assert [(law.tick, law.name) for law in log.laws] == [
        (200 * i, name) for i, name in enumerate(in_order)
    ]
    for topic in (topics.LAW, topics.TF, topics.TF_STATIC, topics.ROBOT_DESCRIPTION):
        graph, here = (
            [data for _, data in open_bag(bag).messages(topic)]
            for bag in (flown.bag, tmp_path / "bag")
        )
        assert len(here) == {topics.LAW: 5, topics.TF: 50}.get(topic, 1)
        assert graph == here, topic


def test_nothing_is_lost_and_every_tick_is_in_the_bag(fly: Callable[..., Flown]) -> None:
    flown = fly(*LONG)
    assert flown.report["lost"] == {topic.full_name: 0 for topic in topics.ALL}
    assert flown.report["ticks"] == 6000
    with Reader(flown.bag) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
    assert counts["/joint_states"] == counts["/base/state"] == counts["/command"] == 6000
    assert counts["/clock"] == counts["/controller/telemetry"] == 300


def test_command_answers_the_state_it_is_stamped_with(fly: Callable[..., Flown]) -> None:
    """Torque sent at tick k is reported as applied with the state of tick k+1."""
    flown = fly("--controller", "tde_stc", "--case", "3", *SHORT)
    log, commands = read_flight(flown.bag), {}
    with Reader(flown.bag) as reader:
        wanted = [c for c in reader.connections if c.topic == "/command"]
        for _, stamp, raw in reader.messages(wanted):
            message = jazzy().deserialize_cdr(raw, "sensor_msgs/msg/JointState")
            assert message.name[:3] == ["base_x", "base_y", "base_z"]
            commands[stamp // 500_000] = message.effort
    sent = np.array([commands[k] for k in range(log.ticks - 1)])
    np.testing.assert_array_equal(log.applied_torque[1:], sent)


def test_publish_times_are_the_senders(fly: Callable[..., Flown]) -> None:
    """A command is sent after the state it answers; log times are simulated ones."""
    (file,) = fly(*LONG).bag.glob("*.mcap")
    sent: dict[str, dict[int, int]] = {}
    with file.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            sent.setdefault(channel.topic, {})[message.log_time] = message.publish_time
    states, commands = sent["/base/state"], sent["/command"]
    assert states.keys() == commands.keys() == {tick * 500_000 for tick in range(6000)}
    latencies = [commands[stamp] - states[stamp] for stamp in states]
    assert min(latencies) > 0
    for times in (states, commands):
        assert list(times.values()) == sorted(times.values())
        assert abs(max(times.values()) - time.time_ns()) < 3600e9  # since 1970


def _rotations(log: FlightLog) -> np.ndarray:
    out = np.empty((log.ticks, 3, 3))
    for k in range(log.ticks):
        rotation_matrix(log.quaternion[k].copy(), out[k])
    return out


def test_momentum_on_the_bag(fly: Callable[..., Flown]) -> None:
    """No force acts on the whole: P stays zero, L is the impulse of the base torque alone."""
    log = read_flight(fly(*LONG).bag)
    robot = Flight(resolve(FlightPlan())).robot
    rotation, period = _rotations(log), log.timebase.period
    mean_rotation = 0.5 * (rotation[:-1] + rotation[1:])
    impulse = period * np.einsum("kij,kj->ki", mean_rotation, log.applied_torque[1:, :3])
    gained = np.vstack([np.zeros(3), np.cumsum(impulse, axis=0)])
    for k in (0, 1500, 3000, 4500, 5999):
        linear, angular = momentum(robot, log.state(k))
        np.testing.assert_allclose(linear, 0.0, atol=1e-9)
        np.testing.assert_allclose(angular, gained[k], atol=1e-9)
    assert np.abs(gained[-1]).max() > 0.5  # the test is not vacuous


def test_energy_on_the_bag(fly: Callable[..., Flown]) -> None:
    """Kinetic energy is the actuators' work less what friction took."""
    log = read_flight(fly(*LONG).bag)
    flight = Flight(resolve(FlightPlan()))
    friction, period = flight.plant_settings.friction, log.timebase.period
    torque, rate = log.applied_torque[1:], log.joint_velocities
    mean_omega = 0.5 * (log.omega_base[:-1] + log.omega_base[1:])
    work = np.sum(torque[:, :3] * mean_omega) * period
    work += np.sum(torque[:, 3:] * np.diff(log.joint_positions, axis=0))
    power = np.sum(friction.coulomb * np.abs(rate) + friction.viscous * rate**2, axis=1)
    heat = np.sum(0.5 * (power[:-1] + power[1:])) * period
    gained = kinetic_energy(flight.robot, log.state(log.ticks - 1))
    gained -= kinetic_energy(flight.robot, log.state(0))
    assert gained == pytest.approx(work - heat, abs=1e-6)
    assert gained > 0.05


def test_late_commands_are_applied_late_in_the_graph(fly: Callable[..., Flown]) -> None:
    flown = fly(*SHORT, "--command-latency-ticks", "2", COMPOSED)
    log = read_flight(flown.bag)
    assert np.all(log.applied_torque[:3] == 0.0)
    assert flown.report["rms"]["mean_axis"]["attitude"] < 1e-6
    in_process = simulate(Flight(resolve(FlightPlan(duration=0.5, command_latency_ticks=2))))
    np.testing.assert_array_equal(log.joint_positions, in_process.joint_positions)


def test_wall_clock_flight_flies_every_tick(fly: Callable[..., Flown]) -> None:
    flown = fly("--duration", "1", "--realtime")
    assert flown.report["ticks"] == 2000
    assert not any(flown.report["lost"].values())
    assert 0 <= flown.report["unanswered_ticks"] < 2000
    assert flown.report["rms"]["mean_axis"]["attitude"] < 1e-3


def test_analyze_prints_the_same_report(fly: Callable[..., Flown]) -> None:
    flown = fly(*LONG)
    result = space_robot_here("analyze", str(flown.bag), "--json")
    assert result.returncode == 0
    assert json.loads(result.stdout) == flown.bag_report


def test_seven_joint_robot_flies_in_the_graph(fly: Callable[..., Flown]) -> None:
    flown = fly(
        *SHORT, "--robot", "seven_joint", "--split-size", "200K", "--compression", "zstd", COMPOSED
    )
    report = flown.report
    assert len(list(flown.bag.glob("*.mcap"))) > 1
    assert set(report["rms"]["eq64"]) == {
        "attitude",
        "joints_1_3",
        "joints_4_7",
        "base_torque",
        "torque_1_3",
        "torque_4_7",
    }
    assert report["rms"]["mean_axis"]["attitude"] < 1e-6
