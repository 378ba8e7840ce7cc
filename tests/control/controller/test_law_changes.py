"""Laws and gains changed in flight as with ``ros2 param set``: recorded, told, replayed."""

from __future__ import annotations

import subprocess
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from flights import COMMAND, ros_environment, space_robot_here

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.temporary_node import TemporaryNode
from space_robot.flight.replay.outcome import ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")
SWAP_S = 6.0
"""Late enough for the pilot to have changed everything before, on a busy machine, too."""
SECONDS = 7.5
"""Long enough after the swap for the pilot to ask for the law."""


class Pilot:
    """Changes a controller's parameters with the services of ``ros2 param``."""

    def __init__(self, domain: int) -> None:
        from rcl_interfaces.srv import GetParameters, SetParameters
        from rclpy.executors import SingleThreadedExecutor
        from rosgraph_msgs.msg import Clock

        self._visitor = TemporaryNode("pilot", domain)
        node = self._visitor.node
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self._set = node.create_client(SetParameters, "/controller_node/set_parameters")
        self._get = node.create_client(GetParameters, "/controller_node/get_parameters")
        self._types = SetParameters.Request, GetParameters.Request
        self.simulated_s = 0.0
        node.create_subscription(Clock, "/clock", self._hear, 10)

    def _hear(self, message: object) -> None:
        self.simulated_s = message.clock.sec + message.clock.nanosec * 1e-9  # type: ignore[attr-defined]

    def wait_until(self, simulated_s: float) -> None:
        until = time.monotonic() + 150.0
        while self.simulated_s < simulated_s and time.monotonic() < until:
            self._executor.spin_once(timeout_sec=1.0)

    def set(self, **values: object) -> list[bool]:
        """In one call; whether each was accepted."""
        from rclpy.parameter import Parameter

        parameters = [Parameter(k.replace("__", "."), value=v) for k, v in values.items()]
        request = self._types[0](parameters=[p.to_parameter_msg() for p in parameters])
        return [result.successful for result in self._call(self._set, request).results]

    def law(self) -> str:
        """The parameter ``controller``."""
        answer = self._call(self._get, self._types[1](names=["controller"]))
        return str(answer.values[0].string_value)

    def _call(self, client: Any, request: Any) -> Any:
        assert client.wait_for_service(30.0), client.srv_name
        future = client.call_async(request)
        self._executor.spin_until_future_complete(future, 30.0)
        assert future.done(), client.srv_name
        return future.result()

    def close(self) -> None:
        self._executor.shutdown()
        self._visitor.leave()


class Flown:
    """What came of the flight, and the parameter ``controller`` after the planned swap."""

    def __init__(self, bag: Path, errors: str, table: str, swapped_to: str) -> None:
        self.bag, self.errors, self.table, self.swapped_to = bag, errors, table, swapped_to
        self.log: FlightLog = read_flight(bag)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Swapped, refused, two gains in two calls, there and back between two looks, and a plan."""
    bag = tmp_path_factory.mktemp("changed") / "bag"
    with ros_domain() as domain:
        pass  # a free one, for the flight to take
    process = subprocess.Popen(
        [
            *COMMAND,
            "fly",
            "--duration",
            str(SECONDS),
            "--swap",
            f"{SWAP_S}:tde_smc",
            "--bag",
            str(bag),
            "--domain",
            str(domain),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ros_environment(),
    )
    try:
        swapped_to = change_laws(domain)
        table, errors = process.communicate(timeout=150)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    return Flown(bag, errors, table, swapped_to)


def change_laws(domain: int) -> str:
    """The law by its parameter after the planned swap."""
    with closing(Pilot(domain)) as pilot:
        pilot.wait_until(0.1)
        assert pilot.set(controller="tde_tsmc") == [True]
        pilot.wait_until(pilot.simulated_s + 0.02)
        assert pilot.set(controller="pid", tde_stc__k_1=[0.3], tde_stc__lambda=[-1.0]) == [
            False,
            True,
            False,
        ]
        for _ in range(2):
            assert pilot.set(tde_tsmc__k_1=[0.5]) == [True]
            pilot.wait_until(pilot.simulated_s + 0.02)
        assert pilot.set(controller="ctc", tde_tsmc__k_d=[3.0]) == [True, True]
        pilot.wait_until(pilot.simulated_s + 0.05)
        assert pilot.set(controller="tde_stc") == [True]
        pilot.wait_until(SWAP_S + 0.05)
        return pilot.law()


def test_every_change_is_in_the_bag_with_its_tick(flown: Flown) -> None:
    laws = flown.log.laws
    names = [law.name for law in laws]
    assert names == ["tde_stc", "tde_tsmc", "tde_tsmc", "ctc", "tde_stc", "tde_smc"]
    ticks = [law.tick for law in laws]
    assert ticks == sorted(set(ticks))
    assert (ticks[0], ticks[-1]) == (0, round(SWAP_S / 0.0005))
    assert [law.is_first for law in laws] == [True, *[False] * 5]
    assert laws[1].gains["k_1"] != laws[2].gains["k_1"] == (0.5,) * 9
    assert laws[0].gains["k_1"] != laws[4].gains["k_1"] == (0.3,) * 9
    assert laws[0].gains["lambda"] == laws[4].gains["lambda"], "that one was refused"


def test_the_parameter_tells_the_law_after_a_planned_swap(flown: Flown) -> None:
    assert flown.swapped_to == "tde_smc"


def test_it_replays_to_the_last_bit(flown: Flown, domain: int) -> None:
    done = replay(ReplayOptions(flown.bag, domain=domain))
    assert done.is_judged
    assert done.comparison.is_identical, done.report()["first_difference"]
    assert len(done.comparison.ticks) == flown.log.ticks


def test_a_part_begins_under_the_law_in_force_there(flown: Flown, domain: int) -> None:
    """CTC has no memory: it is equal again once it has taken over from the applied torque."""
    ctc = flown.log.laws[3]
    until = flown.log.laws[4].tick
    period = flown.log.timebase.period
    done = replay(
        ReplayOptions(
            flown.bag, domain=domain, start_s=(ctc.tick + 1) * period, end_s=until * period
        )
    )
    assert done.comparison.ticks.tolist() == list(range(ctc.tick + 1, until))
    assert not done.comparison.equal[0]
    assert done.comparison.equal[45:].all(), "the transfer lasts 40 ticks, in flight and now"


def test_another_controller_flies_its_own_law_throughout(flown: Flown) -> None:
    result = space_robot_here("replay", str(flown.bag), "--controller", "ctc", "--end", "0.5")
    assert result.returncode == 0, result.stderr
    assert "ctc, gains default" in result.stdout
