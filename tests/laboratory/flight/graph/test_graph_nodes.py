"""Nodes started one by one, as with ``ros2 run``: any order, live parameters, clear refusals."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from flights import Start, forked_space_robot, ros_environment
from forked import Forked

from space_robot.flight.graph.listeners import wait_for
from space_robot.processes.node_modules import MODULES
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")


def _end(process: Forked, number: int = signal.SIGINT) -> int:
    process.send_signal(number)
    process.communicate(timeout=30)
    return process.returncode


def test_start_up_in_any_order(start: Start, tmp_path: Path) -> None:
    """Plant first and recorder last: nothing moves until all are there, nothing is lost."""
    plant = start("plant", ticks=300, wait_for=wait_for("plant"))
    time.sleep(1.0)
    controller = start("controller", wait_for=wait_for("controller"))
    time.sleep(0.5)
    mission = start("mission")
    recorder = start("recorder", bag=tmp_path / "bag")
    output, _ = plant.communicate(timeout=90)
    assert plant.returncode == 0, output
    assert [_end(mission), _end(controller), _end(recorder)] == [0, 0, 0]
    log = read_flight(tmp_path / "bag")
    assert log.ticks == 300
    assert not any(log.lost.values())


def test_controller_can_be_replaced_in_flight(start: Start, tmp_path: Path) -> None:
    """Lockstep holds the plant while no controller is there; the next one takes over."""
    recorder = start("recorder", bag=tmp_path / "bag")
    mission = start("mission")
    plant = start("plant", ticks=3000, wait_for="[recorder_node]")
    first = start("controller", wait_for="[recorder_node, plant_node:/command]")
    file = tmp_path / "bag" / "bag_0.mcap"
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not (file.exists() and file.stat().st_size > 50_000):
        time.sleep(0.02)
    first.kill()
    start("controller", controller="ctc")
    output, _ = plant.communicate(timeout=90)
    assert plant.returncode == 0, output
    assert [_end(mission), _end(recorder)] == [0, 0]
    assert read_flight(tmp_path / "bag").ticks == 3000


def test_law_and_gains_change_in_flight(start: Start, domain: int) -> None:
    from rcl_interfaces.srv import DescribeParameters, SetParameters
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.parameter import Parameter

    mission, controller, plant = start("mission"), start("controller"), start("plant")
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    executor = SingleThreadedExecutor(context=context)
    node = rclpy.create_node(f"test_{os.getpid()}", context=context)
    executor.add_node(node)
    try:
        client = node.create_client(SetParameters, "/controller_node/set_parameters")
        describe = node.create_client(DescribeParameters, "/controller_node/describe_parameters")
        assert client.wait_for_service(30.0)
        assert describe.wait_for_service(30.0)

        def change(name: str, value: object) -> tuple[bool, str]:
            request = SetParameters.Request()
            request.parameters = [Parameter(name, value=value).to_parameter_msg()]
            future = client.call_async(request)
            executor.spin_until_future_complete(future, 30.0)
            result = future.result().results[0]
            return result.successful, result.reason

        names = ["controller", "tde_stc.h_bar", "tde_stc.k_1"]
        asked = describe.call_async(DescribeParameters.Request(names=names))
        executor.spin_until_future_complete(asked, 30.0)
        assert [d.additional_constraints for d in asked.result().descriptors] == [
            "one of tde_stc, adrc, ctc, ctc_smc, dob, indi, pd, pd_feedforward, slotine_li, "
            "tde_smc, tde_tsmc",
            "9 values (base x, y, z and the joints) or 1; finite values above 0 (or nominal: as "
            "numbers all 0)",
            "9 values (base x, y, z and the joints) or 1; finite values 0 or more",
        ]
        assert change("controller", "tde_tsmc") == (True, "")
        assert change("tde_tsmc.k_1", [0.5]) == (True, "")
        refused, reason = change("controller", "pid")
        assert not refused
        assert "choose one of" in reason
        refused, reason = change("tde_tsmc.h_bar", [-1.0])
        assert not refused
        assert "above 0" in reason
        refused, reason = change("tde_tsmc.k_1", [0.5, 0.5])
        assert not refused
        assert "9 values" in reason
        for name, value in (("robot", "seven_joint"), ("use_sim_time", True)):
            assert change(name, value)[0] is False  # read-only
    finally:
        node.destroy_node()
        context.try_shutdown()
    assert plant.poll() is None
    assert [_end(plant), _end(controller), _end(mission)] == [0, 0, 0]


@pytest.mark.parametrize(
    ("node", "parameters", "said"),
    [
        ("plant", {"command_latency_ticks": -1}, "greater than or equal to 0, got -1"),
        ("plant", {"comand_latency_ticks": 1}, "unknown parameter 'comand_latency_ticks'"),
        ("plant", {"case": 9}, "unknown case '9': choose one of 1, 2"),
        ("plant", {"robot": "xyz"}, "unknown robot 'xyz': choose one of boom, canadarm"),
        ("controller", {"period": 1}, "period: Input should be less than or equal to 0.1, got 1"),
        ("controller", {"controller": "pid"}, "unknown controller 'pid'"),
        ("controller", {"tde_stc__k_1": "[1.0, 2.0]"}, "9 values (base x, y, z and the joints)"),
        ("mission", {"waypoint_times": "[0.0]"}, "waypoints_deg has 18 values"),
        ("recorder", {"bag": "/proc/no/bag"}, "no bag can be written there"),
        ("recorder", {"bagg": "b"}, "unknown parameter 'bagg'"),
    ],
)
def test_node_refuses_bad_parameters(
    start: Start, node: str, parameters: dict[str, object], said: str
) -> None:
    process = start(node, **parameters)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 2
    assert said in output
    assert "recording to" not in output
    assert "Traceback" not in output


@pytest.mark.parametrize("node", MODULES)
def test_help_is_a_few_lines(node: str) -> None:
    pytest.importorskip("rclpy")
    process = Forked(MODULES[node], ["--help"], ros_environment())
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0, output
    usage, *parameters = output.splitlines()
    assert usage.startswith(f"usage: {node}_node [--ros-args")
    assert "autostart, robot, period" in parameters[0]


@pytest.mark.parametrize(
    "arguments", [["--case", "3"], ["--case", "3", "--ros-args", "-p", "x:=1"]]
)
def test_arguments_that_are_not_of_ros_are_refused(arguments: list[str]) -> None:
    pytest.importorskip("rclpy")
    process = forked_space_robot("plant_node", *arguments)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    (line,) = errors.splitlines()
    assert line.startswith("plant_node: error: unknown argument '--case'")
