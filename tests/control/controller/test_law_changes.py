"""Laws and gains changed in flight, nodes that die: told, recorded, replayed; on real graphs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import RESERVED, forked_space_robot, space_robot_here, wait_for_nodes

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.replay.run import replay
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

from ground import Ground
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

PERIOD = 5e-4
SWAP_S, KILL_S = 0.5, 0.6
"""After all that the pilot changes: the plant goes on when the pilot says so, and no further."""


class Pilot(Ground):
    """Lets a paused plant go on, and changes a controller's parameters as ``ros2 param`` does."""

    def set(self, node: str = "controller", **values: object) -> list[bool]:
        """In one call; whether each was accepted."""
        parameters = [Parameter(k.replace("__", "."), value=v) for k, v in values.items()]
        request = SetParameters.Request(parameters=[p.to_parameter_msg() for p in parameters])
        answer = self.call(SetParameters, f"/{node}_node/set_parameters", request)
        return [result.successful for result in answer.results]

    def law(self) -> str:
        """The parameter ``controller``."""
        request = GetParameters.Request(names=["controller"])
        answer = self.call(GetParameters, "/controller_node/get_parameters", request)
        return str(answer.values[0].string_value)

    def ask_plant(self, action: str) -> str:
        """What it answers, if it does so."""
        answer = self.call(Trigger, f"/plant_node/{action}", Trigger.Request())
        return answer.message if answer.success else ""

    def step(self, ticks: int) -> int:
        """The tick at which it then stands."""
        assert self.set("plant", step_ticks=ticks) == [True]
        message = self.ask_plant("step")
        assert message.startswith("stepped to tick ")
        return int(message.split()[3])

    def step_until(self, is_there: Callable[[], bool], ticks: int, what: str) -> None:
        """Step some ticks, and again until something is so."""

        def stepped() -> bool:
            tick = self.step(ticks)
            self.until(lambda: self.value("plant", "tick") >= tick, "its diagnostics")
            return is_there()

        self.until(stepped, what)


class Flown:
    """What came of a flight."""

    def __init__(self, bag: Path, output: str, errors: str) -> None:
        self.bag, self.errors, self.log = bag, errors, read_flight(bag)
        self.report: dict[str, Any] = json.loads(output)

    def time_of(self, node: str, what: str, after: float = 0.0) -> float:
        """Simulated time of the first event of a node that begins so."""
        for event in self.report["graph"]["events"]:
            is_it = event["node"] == f"{node}_node" and event["what"].startswith(what)
            if is_it and event["simulated_s"] >= after:
                return float(event["simulated_s"])
        raise AssertionError(f"{node}: {what!r} not in {self.report['graph']['events']}")


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flown]:
    """Swapped, refused, two gains in two calls, there and back between two looks, and a plan; then
    the controller is killed, and another one takes over."""
    bag = tmp_path_factory.mktemp("changed") / "bag"
    with ros_domain(namespace=RESERVED) as domain:
        yield flown_in(domain, bag)


def flown_in(domain: int, bag: Path) -> Flown:
    plan = f"--duration 3 --swap {SWAP_S}:tde_smc --set plant.silence_timeout=0.2 --json".split()
    plan += ["--set", "plant.hold_ticks=100"]
    death = ["--restart-controller", "--fault", f"kill_controller@{KILL_S}"]
    place = ["--bag", str(bag), "--domain", str(domain)]
    process = forked_space_robot("fly", "--paused", *plan, *death, *place)
    try:
        wait_for_nodes(domain)
        change_laws(domain)
        output, errors = process.communicate(timeout=150)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    return Flown(bag, output, errors)


def change_laws(domain: int) -> None:
    with closing(Pilot(domain)) as pilot:
        pilot.until(lambda: bool(pilot.ask_plant("step")), "an active plant")
        pilot.step(500)
        assert pilot.set(controller="tde_tsmc") == [True]
        pilot.step(40)
        gains: dict[str, object] = {"tde_stc__k_1": [0.3], "tde_stc__lambda": [-1.0]}
        assert pilot.set(controller="pid", **gains) == [False, True, False]
        for _ in range(2):
            assert pilot.set(tde_tsmc__k_1=[0.5]) == [True]
            pilot.step(40)
        assert pilot.set(controller="ctc", tde_tsmc__k_d=[3.0]) == [True, True]
        pilot.step(100)
        assert pilot.set(controller="tde_stc") == [True]
        pilot.step(400)
        assert pilot.law() == "tde_smc", "the parameter tells the law after a planned swap"
        # long enough that the controller dies, and is missed, before the next one is there
        pilot.step_until(lambda: pilot.value("plant", "missed_deadlines") >= 250, 2000, "silence")
        dead = pilot.value("plant", "tick")
        pilot.step_until(lambda: pilot.value("controller", "tick") > dead, 20, "the next one")
        pilot.step(400)
        assert pilot.ask_plant("resume")


def test_every_change_is_in_the_bag_with_its_tick(flown: Flown) -> None:
    laws = flown.log.laws
    names = [law.name for law in laws]
    assert names[:6] == ["tde_stc", "tde_tsmc", "tde_tsmc", "ctc", "tde_stc", "tde_smc"]
    ticks = [law.tick for law in laws]
    assert ticks == sorted(set(ticks))
    assert (ticks[0], ticks[5]) == (0, round(SWAP_S / PERIOD))
    assert ticks[6] > KILL_S / PERIOD
    assert [law.is_first for law in laws] == [True, *[False] * 5, True]
    assert laws[1].gains["k_1"] != laws[2].gains["k_1"] == (0.5,) * 9
    assert laws[0].gains["k_1"] != laws[4].gains["k_1"] == (0.3,) * 9
    assert laws[0].gains["lambda"] == laws[4].gains["lambda"], "that one was refused"


def test_a_dead_controller_leaves_the_plant_holding_then_without_torque(flown: Flown) -> None:
    """And the next one takes over from no torque: its first step is like those of its next 10 ms.

    The force before the death would be a step of hundreds of times that.
    """
    assert flown.report["graph"]["restarts"] == 1
    killed = round(flown.time_of("controller", "killed") / PERIOD)
    torque = flown.log.applied_torque
    acts = np.abs(torque[killed:]).max(axis=1) > 0.0
    safe = killed + int(np.argmin(acts))
    back = safe + int(np.argmax(acts[safe - killed :]))
    assert killed < safe < back
    held = torque[safe - 50 : safe]
    np.testing.assert_array_equal(held, np.broadcast_to(held[0], held.shape))
    steps = np.abs(np.diff(torque[back - 1 : back + 20], axis=0))
    assert np.all(steps[0] <= 3.0 * steps[1:].max(axis=0))


def test_it_replays_to_the_last_bit(flown: Flown) -> None:
    """The replayed controller, too, begins again where the other did."""
    assert flown.log.commanded_torque is not None
    answered = np.flatnonzero(np.isfinite(flown.log.commanded_torque).all(axis=1))
    assert flown.log.laws[6].tick in answered, "the recorder has missed the first answer"
    done = replay(flown.bag)
    assert done.is_judged
    assert done.comparison.is_identical, done.report()["first_difference"]
    np.testing.assert_array_equal(done.comparison.ticks, answered)


def test_without_mission_the_last_point_is_held_and_without_recorder_the_exit_code_tells(
    tmp_path: Path,
) -> None:
    limits = ["--set", "controller.reference_timeout=0.2", "--set", "mission.lead_ticks=200"]
    kinds = "stop_controller@0.05:0.1", "kill_mission@0.2", "kill_recorder@1.2"
    faults = ["--duration", "2", *(word for kind in kinds for word in ("--fault", kind))]
    result = space_robot_here("fly", "--bag", str(tmp_path / "bag"), "--json", *limits, *faults)
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    assert "recorder ended by signal 9" in result.stderr
    flown = Flown(tmp_path / "bag", result.stdout, result.stderr)
    flown.time_of("controller", "holding the reference: the mission is silent", after=0.2)
    flown.time_of("controller", "goes on (SIGCONT)")
    assert flown.report["unfinished"]
    nodes = flown.report["graph"]["nodes"]
    assert int(nodes["controller_node"]["references_held"]) > 100
    assert int(nodes["plant_node"]["tick"]) == 4_000
