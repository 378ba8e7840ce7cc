"""Laws and gains changed in flight as with ``ros2 param set``: recorded, told, replayed."""

from __future__ import annotations

import threading
import time
from contextlib import closing
from pathlib import Path

import pytest
from flights import forked_space_robot, space_robot_here, wait_for_nodes

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.node_services import call_trigger, get_parameters, set_parameters
from space_robot.flight.graph.temporary_node import TemporaryNode
from space_robot.flight.replay.outcome import ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")
SWAP_S = 0.5
"""After all that the pilot changes: the plant goes on when the pilot says so, and no further."""
SECONDS = 0.6
TIMEOUT_S = 150.0


class Pilot:
    """Lets a paused plant go on, and changes a controller's parameters as ``ros2 param`` does."""

    def __init__(self, domain: int) -> None:
        from rcl_interfaces.srv import SetParameters

        self._visitors = [TemporaryNode(name, domain) for name in ("pilot", "stepper")]
        self._node, self._stepper = (visitor.node for visitor in self._visitors)
        self._set = self._node.create_client(SetParameters, "/controller_node/set_parameters")
        self._request = SetParameters.Request
        self._until = time.monotonic() + TIMEOUT_S

    def _check(self) -> None:
        assert time.monotonic() < self._until

    def begin(self) -> None:
        """Fly the first tick, as soon as the plant is active."""
        self.law()  # with its answer those of the other service arrive, too
        while not self._ask_plant("step"):
            self._check()

    def step(self, ticks: int) -> None:
        set_parameters(self._stepper, "plant_node", {"step_ticks": ticks}, self._check)
        assert self._ask_plant("step")

    def resume(self) -> None:
        assert self._ask_plant("resume")

    def _ask_plant(self, action: str) -> bool:
        return call_trigger(self._stepper, f"plant_node/{action}", self._check)[0]

    def set(self, **values: object) -> list[bool]:
        """In one call; whether each was accepted."""
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter

        parameters = [Parameter(k.replace("__", "."), value=v) for k, v in values.items()]
        request = self._request(parameters=[p.to_parameter_msg() for p in parameters])
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        future = self._set.call_async(request)
        executor.spin_until_future_complete(future, TIMEOUT_S)
        executor.shutdown()
        assert future.done()
        return [result.successful for result in future.result().results]

    def law(self) -> str:
        """The parameter ``controller``."""
        return str(get_parameters(self._node, "controller_node", ["controller"], self._check)[0])

    def close(self) -> None:
        for visitor in self._visitors:
            visitor.leave()


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
    plan = ("--duration", str(SECONDS), "--swap", f"{SWAP_S}:tde_smc", "--bag", str(bag))
    process = forked_space_robot("fly", "--paused", *plan, "--domain", str(domain))
    try:
        wait_for_nodes(domain)
        swapped_to = change_laws(domain)
        table, errors = process.communicate(timeout=TIMEOUT_S)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    return Flown(bag, errors, table, swapped_to)


def change_laws(domain: int) -> str:
    """The law by its parameter after the planned swap."""
    with closing(Pilot(domain)) as pilot:
        pilot.begin()
        pilot.step(100)
        going_on = threading.Thread(target=pilot.step, args=[400])
        going_on.start()
        assert pilot.set(controller="tde_tsmc") == [True]
        going_on.join()
        pilot.step(40)
        assert pilot.set(controller="pid", tde_stc__k_1=[0.3], tde_stc__lambda=[-1.0]) == [
            False,
            True,
            False,
        ]
        for _ in range(2):
            assert pilot.set(tde_tsmc__k_1=[0.5]) == [True]
            pilot.step(40)
        assert pilot.set(controller="ctc", tde_tsmc__k_d=[3.0]) == [True, True]
        pilot.step(100)
        assert pilot.set(controller="tde_stc") == [True]
        pilot.step(400)
        law = pilot.law()
        pilot.resume()
        return law


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
