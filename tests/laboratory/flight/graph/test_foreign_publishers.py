"""Others on the topics of a flight, restarted nodes, late listeners: the flight goes on."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from flights import Start
from forked import Forked

from space_robot.flight.graph.listeners import wait_for
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults
from space_robot_msgs_py.samples import Command, ReferenceChunk, RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.clock import ClockCodec
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

set_defaults()
rclpy = pytest.importorskip("rclpy")

from rclpy.event_handler import SubscriptionEventCallbacks  # noqa: E402

from space_robot.flight.graph.monitor import Monitor  # noqa: E402
from space_robot_msgs_py.ros.endpoints import RawPublisher, message_type, qos  # noqa: E402

TIMEOUT_S = 60.0
TIMEBASE = Timebase(500_000)


@pytest.fixture
def monitor(domain: int) -> Iterator[Monitor]:
    watching = Monitor(domain)
    yield watching
    watching.close()


def until(monitor: Monitor, done: Callable[[], bool], meanwhile: Callable[[], None]) -> None:
    """Poll until ``done``, doing something in between."""
    deadline = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < deadline, (monitor.modes, monitor.values)
        monitor.poll()
        meanwhile()


def pause() -> None:
    time.sleep(0.02)


def junk(robot: Robot, names: RobotNames) -> dict[topics.Topic, list[bytes]]:
    """Messages of every kind of misfit, by topic."""
    future, none = RobotState.allocate(robot.n), RobotState.allocate(robot.n)
    future.tick, none.tick = 10**7, 3
    none.quaternion[:] = none.wheel_velocities[:] = np.nan
    other = Robot.from_yaml("config/robots/seven_joint.yaml")
    states = StateCodec(names, TIMEBASE)
    actuators = {part: ("other", *getattr(names, part)) for part in ("wheels", "thrusters")}
    foreign = StateCodec(RobotNames(other.joint_names, **actuators), TIMEBASE)
    sent = [
        dict(zip(codec.topics, codec.encode(state), strict=True))
        for codec, state in (
            (states, future),
            (states, none),
            (foreign, RobotState.allocate(other.n)),
        )
    ]
    commands = CommandCodec(names.commanded, TIMEBASE)
    torque = np.full(len(names.commanded), np.nan)
    chunks = [
        ReferenceCodec(names, TIMEBASE).encode(ReferenceChunk(start, joints, base))
        for names, start, joints, base in (
            (other.joint_names, 0, np.zeros((5, 3, other.n)), np.zeros((5, 10))),
            (robot.joint_names, 0, np.full((5, 3, robot.n), np.nan), np.full((5, 10), np.nan)),
            (robot.joint_names, 10**7, np.zeros((5, 3, robot.n)), np.zeros((5, 10))),
        )
    ]
    return {
        **{topic: [state[topic] for state in sent] + [b"\0\1\0\0junk"] for topic in states.topics},
        topics.COMMAND: [
            commands.encode(Command(10**7, torque)),
            commands.encode(Command(1, torque)),
            b"\0\1",
        ],
        topics.REFERENCE_JOINTS: [joints for joints, _ in chunks] + [b"\0\1\0\0junk"],
        topics.REFERENCE_BASE: [base for _, base in chunks] + [b"\0\1\0\0junk"],
        topics.CLOCK: [ClockCodec().encode(k) for k in (10**15, 7, 0)],
    }


@pytest.mark.parametrize("actuators", ["ideal", "wheels_and_thrusters"])
def test_a_flood_of_junk_on_every_topic_changes_nothing(
    actuators: str, start: Start, monitor: Monitor, paper_robot: Robot
) -> None:
    """The flight goes on, its reference never held; what came is counted."""
    start("mission")
    start("controller", actuators=actuators)
    others = [name for name in wait_for("plant") if not name.startswith("recorder")]
    plant = start("plant", wait_for=others, actuators=actuators)
    until(monitor, lambda: monitor.simulated_s > 0.0, pause)
    names = assumed_actuators(actuators, paper_robot).robot_names(paper_robot)
    bursts = junk(paper_robot, names)
    outs = {topic: RawPublisher(monitor.node, topic) for topic in bursts}
    heard = [out for topic, out in outs.items() if topic is not topics.THRUSTERS_STATE]
    until(monitor, lambda: all(out.listener_count for out in heard), pause)
    k, begun_s = 0, monitor.simulated_s

    def flood() -> None:
        nonlocal k
        for topic, out in outs.items():
            out.publish(bursts[topic][k % len(bursts[topic])])
        k += 1
        time.sleep(0.001)  # leave the flight some of the processor

    until(monitor, lambda: k > 200 and monitor.simulated_s > begun_s + 0.5, flood)
    plant.send_signal(signal.SIGINT)
    output, _ = plant.communicate(timeout=TIMEOUT_S)
    assert plant.returncode == 0, output
    until(monitor, lambda: "silence_s" in monitor.values.get("controller_node", {}), pause)
    told = monitor.values["controller_node"]
    assert int(told["references_held"]) == 0
    assert any(key.startswith("rejected: another publisher's on /") for key in told), told


def test_a_restarted_plant_is_flown_without_ado(start: Start) -> None:
    """From tick 0 again, in lockstep and by the wall clock, with the same controller, mission."""
    start("mission")
    start("controller")
    for realtime in (False, False, True, True):
        plant = start("plant", ticks=400, realtime=str(realtime).lower())
        output, _ = plant.communicate(timeout=TIMEOUT_S)
        assert plant.returncode == 0, output
        assert "flew 0.2000 s" in output


def test_a_missing_mission_is_told_and_a_restarted_one_followed(
    start: Start, monitor: Monitor
) -> None:
    """Before the first state and in flight: nothing is held where there is time to wait."""
    start("controller", reference_timeout=TIMEOUT_S)
    start("plant", silence_timeout=0.0)
    waiting = "waiting for the reference: no mission sends it"
    until(monitor, lambda: monitor.modes.get("controller_node") == waiting, pause)
    first: Forked = start("mission")
    until(monitor, lambda: monitor.simulated_s > 0.2, pause)
    first.send_signal(signal.SIGKILL)
    until(monitor, lambda: monitor.modes.get("controller_node") == waiting, pause)
    stopped_s = monitor.simulated_s
    start("mission")
    until(monitor, lambda: monitor.simulated_s > stopped_s + 0.5, pause)
    assert int(monitor.values["controller_node"]["references_held"]) == 0


def test_late_listeners_are_told_what_is_needed_and_of_no_lost_message(
    start: Start, monitor: Monitor
) -> None:
    """In the middle of a long stream."""
    start("mission")
    clock, codec = RawPublisher(monitor.node, topics.CLOCK), ClockCodec()
    tick, lost, heard = 0, [], []

    def go_on() -> None:
        nonlocal tick
        tick += 100
        clock.publish(codec.encode(TIMEBASE.stamp_ns(tick)))
        rclpy.spin_once(monitor.node, executor=executor, timeout_sec=0.005)

    executor = rclpy.executors.SingleThreadedExecutor(context=monitor.node.context)
    until(monitor, lambda: clock.listener_count > 1, pause)  # the mission's and the monitor's
    until(monitor, lambda: tick > 25_000, go_on)
    topic = topics.REFERENCE_JOINTS
    for _ in range(3):
        joined_at = tick
        subscription = monitor.node.create_subscription(
            message_type(topic.type),
            topic.full_name,
            lambda message: heard.append(message.header.stamp),
            qos(topic),
            event_callbacks=SubscriptionEventCallbacks(message_lost=lost.append),
        )
        until(monitor, lambda: len(heard) > 40, go_on)
        starts = {TIMEBASE.tick(stamp.sec * 10**9 + stamp.nanosec) for stamp in heard}
        assert min(starts) > joined_at - 2000, "nothing of what is long over"
        assert starts == set(range(min(starts), max(starts) + 1, 100))
        monitor.node.destroy_subscription(subscription)
        heard.clear()
    assert not lost
