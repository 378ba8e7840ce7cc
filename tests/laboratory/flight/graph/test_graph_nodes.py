"""Nodes started one by one, as with ``ros2 run``: any order, live parameters, deaths, refusals."""

from __future__ import annotations

import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from flights import Start, forked_space_robot, ros_environment, simulated
from forked import Forked

from space_robot.flight.graph.node_names import wait_for
from space_robot.processes import MODULES
from space_robot_model.robot import Robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.placements import RobotPoses
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.telemetry import ClockCodec
from space_robot_msgs_py.wire.viewers import no_markers
from space_robot_sim.plant.pacing import PAUSED

set_defaults()
rclpy = pytest.importorskip("rclpy")

from rcl_interfaces.srv import DescribeParameters, SetParameters  # noqa: E402
from rclpy.event_handler import SubscriptionEventCallbacks  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from space_robot_msgs_py.ros.endpoints import (  # noqa: E402
    PolledCallbackGroup,
    RawPublisher,
    RawSubscription,
    message_type,
    qos,
)

if TYPE_CHECKING:
    from ground import Ground

TIMEBASE = Timebase(500_000)
MARKERS_EVERY = 67
"""Ticks of 0.5 ms from one message to the next: 30 Hz at most."""


def ended(process: Forked, number: int = signal.SIGINT) -> int:
    process.send_signal(number)
    process.communicate(timeout=30)
    return process.returncode


def test_start_up_in_any_order(
    start: Start, ground: Ground, tmp_path: Path, paper_robot: Robot
) -> None:
    """Plant first and recorder last: nothing moves until all are there, nothing is lost.

    A viewer sees /markers: those of a flight before are taken away, then each is that of its tick.
    """
    seen = RawSubscription(ground.node, topics.MARKERS, PolledCallbackGroup(), 1_000)
    plant = start("plant", ticks=300, wait_for=wait_for("plant"))
    ground.until(lambda: "plant_node" in ground.monitor.modes, "the plant")
    controller = start("controller", wait_for=wait_for("controller"))
    ground.until(lambda: "controller_node" in ground.monitor.modes, "the controller")
    markers_out = topics.MARKERS.full_name
    ground.until(lambda: ground.node.count_publishers(markers_out) > 0, "the markers")
    mission = start("mission", wait_for=wait_for("mission"))
    recorder = start("recorder", bag=tmp_path / "bag")
    output, _ = plant.communicate(timeout=90)
    assert plant.returncode == 0, output
    assert [ended(mission), ended(controller), ended(recorder)] == [0, 0, 0]
    log = read_flight(tmp_path / "bag")
    assert (log.ticks, log.first_tick) == (300, 0)
    assert not any(log.lost.values())
    found = list(iter(seen.take, None))
    flown = simulated(duration=0.15)
    poses, markers = RobotPoses(paper_robot), RobotMarkers(paper_robot, TIMEBASE)
    ticks = range(0, flown.ticks, MARKERS_EVERY)
    expected = [markers.encode(tick, poses.at(flown.state(tick))) for tick in ticks]
    assert len(found) > 2
    assert found[0].startswith(no_markers())  # the middleware fills messages up to whole words
    for data, ours in zip(reversed(found[1:]), reversed(expected), strict=False):
        assert data.startswith(ours)


def step(ground: Ground, ticks: int) -> str:
    """Where a paused plant then stands."""
    parameter = Parameter("step_ticks", value=ticks).to_parameter_msg()
    request = SetParameters.Request(parameters=[parameter])
    assert ground.call(SetParameters, "/plant_node/set_parameters", request).results[0].successful
    return str(ground.call(Trigger, "/plant_node/step", Trigger.Request()).message)


def test_killed_nodes_are_replaced_in_flight(start: Start, ground: Ground, tmp_path: Path) -> None:
    """Lockstep holds the plant while no controller or no mission is there; the next one takes over.

    Before, another plant was flown with the same controller and mission: time begins anew.
    """
    monitor = ground.monitor
    mission = start("mission", lead_ticks=200)
    waits = {"reference_timeout": 60.0, "wait_for": wait_for("controller", ["recorder_node"])}
    controller = start("controller", **waits)
    plant = start("plant", ticks=200)
    output, _ = plant.communicate(timeout=60)
    assert plant.returncode == 0, output
    assert "flew 0.1000 s" in output
    recorder = start("recorder", bag=tmp_path / "bag")
    waits["wait_for"] = wait_for("controller")
    listeners = {"wait_for": wait_for("plant"), "silence_timeout": 0.0}
    plant = start("plant", ticks=1_000, paused=True, **listeners)
    ground.until(lambda: monitor.modes.get("plant_node") == PAUSED, "a paused plant")
    assert step(ground, 100).startswith("stepped to tick 100")
    controller.kill()
    controller.wait()
    start("controller", controller="ctc", **waits)
    assert step(ground, 100).startswith("stepped to tick 200")
    mission.kill()
    mission.wait()
    with ThreadPoolExecutor() as pool:
        stepped = pool.submit(step, ground, 500)
        waiting = "waiting for the reference: no mission sends it"
        ground.until(lambda: monitor.modes.get("controller_node") == waiting, "no mission")
        start("mission", lead_ticks=200)
        assert stepped.result().startswith("stepped to tick 700")
    assert ended(plant) == 0
    assert int(monitor.values["controller_node"]["references_held"]) == 0
    assert ended(recorder) == 0
    log = read_flight(tmp_path / "bag")
    assert [law.name for law in log.laws] == ["tde_stc", "ctc"]
    assert log.commanded_torque is not None
    missing = np.flatnonzero(~np.isfinite(log.commanded_torque).all(axis=1))
    assert np.all(missing <= 100), "only the first controller does not wait for the recorder"


def test_law_and_gains_are_described_and_what_cannot_be_is_refused_with_its_reason(
    start: Start, ground: Ground
) -> None:
    """To requests as those of `ros2 param`."""
    controller = start("controller")

    def change(name: str, value: object) -> tuple[bool, str]:
        request = SetParameters.Request()
        request.parameters = [Parameter(name, value=value).to_parameter_msg()]
        answer = ground.call(SetParameters, "/controller_node/set_parameters", request)
        return answer.results[0].successful, answer.results[0].reason

    names = ["controller", "tde_stc.h_bar", "tde_stc.k_1"]
    asked = DescribeParameters.Request(names=names)
    told = ground.call(DescribeParameters, "/controller_node/describe_parameters", asked)
    assert [d.additional_constraints for d in told.descriptors] == [
        "one of tde_stc, adrc, ctc, ctc_smc, dob, indi, pd, pd_feedforward, slotine_li, "
        "tde_smc, tde_tsmc",
        "9 values (base x, y, z and the joints) or 1; finite values above 0 (or nominal: as "
        "numbers all 0)",
        "9 values (base x, y, z and the joints) or 1; finite values 0 or more",
    ]
    assert change("controller", "tde_tsmc") == (True, "")
    assert change("tde_tsmc.k_1", [0.5]) == (True, "")
    for name, value, said in (
        ("controller", "pid", "choose one of"),
        ("tde_tsmc.h_bar", [-1.0], "above 0"),
        ("tde_tsmc.k_1", [0.5, 0.5], "9 values"),
        ("robot", "seven_joint", ""),
        ("use_sim_time", True, ""),
    ):
        is_changed, reason = change(name, value)
        assert not is_changed
        assert said in reason
    assert ended(controller) == 0


def test_a_late_listener_of_the_mission_is_told_what_is_needed(
    start: Start, ground: Ground
) -> None:
    """In the middle of a long stream, and of no lost message."""
    start("mission")
    clock, codec = RawPublisher(ground.node, topics.CLOCK), ClockCodec()
    tick, lost, heard = 0, [], []
    executor = rclpy.executors.SingleThreadedExecutor(context=ground.context)

    def go_on(is_done: bool) -> bool:
        nonlocal tick
        tick += 100
        clock.publish(codec.encode(TIMEBASE.stamp_ns(tick)))
        rclpy.spin_once(ground.node, executor=executor, timeout_sec=0.002)
        return is_done

    ground.until(lambda: clock.listener_count > 1, "mission and monitor")
    ground.until(lambda: go_on(tick > 8_000), "a long flight")
    joined_at = tick
    ground.node.create_subscription(
        message_type(topics.REFERENCE_JOINTS.type),
        topics.REFERENCE_JOINTS.full_name,
        lambda message: heard.append(message.header.stamp),
        qos(topics.REFERENCE_JOINTS),
        event_callbacks=SubscriptionEventCallbacks(message_lost=lost.append),
    )
    ground.until(lambda: go_on(len(heard) > 40), "the reference")
    starts = {TIMEBASE.tick(stamp.sec * 10**9 + stamp.nanosec) for stamp in heard}
    assert min(starts) > joined_at - 2000, "nothing of what is long over"
    assert starts == set(range(min(starts), max(starts) + 1, 100))
    assert not lost


BAD: tuple[tuple[str, dict[str, object], str], ...] = (
    ("plant", {"comand_latency_ticks": 1}, "unknown parameter 'comand_latency_ticks'"),
    ("controller", {"tde_stc__k_1": "[1.0, 2.0]"}, "9 values (base x, y, z and the joints)"),
    ("mission", {"joints_deg": "[0.0]"}, "the start has 1 joints"),
    ("recorder", {"bag": "/proc/no/bag"}, "no bag can be written there"),
)


def test_bad_parameters_and_other_arguments_are_refused_and_help_is_a_few_lines(
    start: Start,
) -> None:
    refused = {node: start(node, **parameters) for node, parameters, _ in BAD}
    helped = Forked(MODULES["plant"], ["--help"], ros_environment())
    typed = forked_space_robot("plant_node", "--case", "3", "--ros-args", "-p", "x:=1")
    for node, _, said in BAD:
        output, _ = refused[node].communicate(timeout=60)
        assert refused[node].returncode == 2
        assert said in output
        assert "recording to" not in output
        assert "Traceback" not in output
    usage, *parameters = helped.communicate(timeout=60)[0].splitlines()
    assert helped.returncode == 0
    assert usage.startswith("usage: plant_node [--ros-args")
    assert "autostart, robot, period" in parameters[0]
    (line,) = typed.communicate(timeout=60)[1].splitlines()
    assert typed.returncode == 2
    assert line.startswith("plant_node: error: unknown argument '--case'")
