"""The plant's loop by a clock of its own: lockstep, silence, pauses, the wall clock, the end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import Command
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import ClockCodec
from space_robot_sim.plant.pacing import REMARK_S, SLIP_S, WallClock
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.loop import Level
from space_robot_sim.plant import loop, outputs, pacing
from space_robot_sim.plant.loop import ASK_AGAIN_S, PlantLoop

HOLD, DECIMATION, SILENCE_S = 30, 7, 1.0
PERIOD = 5e-4
STEP_S = 5e-6
"""What a step of the loop takes."""


class Topic:
    """Publisher or subscription: what was sent, and what is to be taken."""

    listener_count = 1

    def __init__(self, node: Bench, topic: topics.Topic, *_: object) -> None:
        self._node, self.topic, self.full_name = node, topic, topic.name
        self.sent: list[bytes] = []
        self.waiting: deque[bytes] = deque()
        node.by_name[topic.name] = self

    def publish(self, data: bytes) -> None:
        self.sent.append(data)
        self._node.hear(self.topic, data)

    def take(self) -> bytes | None:
        return self.waiting.popleft() if self.waiting else None

    def flush(self, timeout_s: float) -> None:
        pass

    def tell(self, is_paused: bool) -> None:
        pass


class Bench:
    """A node for the loop, a clock that its waits advance, and a controller that answers."""

    def __init__(
        self,
        robot: Robot,
        patch: pytest.MonkeyPatch,
        answer: Callable[[int], bool],
        **settings: Any,
    ) -> None:
        """``answer``: whether the state of a tick is answered, with `torque`."""
        self.now, self.answer = 1000.0, answer
        self.by_name: dict[str, Topic] = {}
        self.logged: list[str] = []
        self.waited_s = 0.0
        self.states: list[tuple[int, float]] = []
        """Tick and time of each state that was sent."""
        patch.setattr(time, "monotonic", lambda: self.now)
        for module in (loop, outputs):
            patch.setattr(module, "RawPublisher", Topic)
        patch.setattr(loop, "RawSubscription", Topic)
        patch.setattr(loop, "PausedOutput", lambda node: Topic(node, topics.SIMULATION_PAUSED))
        patch.setattr(outputs, "find_spec", lambda name: None)
        self.settings = PlantNodeSettings.resolve(
            {
                "hold_ticks": HOLD,
                "clock_decimation": DECIMATION,
                "silence_timeout": SILENCE_S,
                "ticks": 100,
                **settings,
            }
        )
        names = Plant(robot, self.settings, PERIOD).names
        self._states = StateCodec(names, self.settings.timebase)
        self._commands = CommandCodec(names.commanded, self.settings.timebase)
        self._robot = robot
        self.loop = PlantLoop(self, self.settings)  # type: ignore[arg-type]
        self.loop.begin()

    def hear(self, topic: topics.Topic, data: bytes) -> None:
        """Answer the last part of a state at once."""
        if topic != self._states.topics[-1]:
            return
        tick = self._states.decode(topic, data, self.loop._plant.state.copy())
        self.states.append((tick, self.now))
        if self.answer(tick):
            self.send(tick, torque(tick))

    def send(self, tick: int, values: Array) -> None:
        message = self._commands.encode(Command(tick, values))
        self.by_name[topics.COMMAND.name].waiting.append(message)

    def run(self, until: Callable[[], bool] | None = None) -> None:
        """Step the loop to its end, or until something holds; its waits pass at once."""
        for _ in range(100_000):
            if self.loop.is_complete or (until and until()):
                return
            wait = self.loop.step()
            self.now += STEP_S
            assert wait is None or wait.seconds > 0.0
            if wait and not any(entry.waiting for entry in wait.inputs):  # type: ignore[attr-defined]
                self.now += wait.seconds
                self.waited_s += wait.seconds
        raise AssertionError("it does not end")

    @property
    def tick(self) -> int:
        return self.loop.control.tick

    def flown_by_hand(self, acting: Callable[[int], Array]) -> Array:
        """The state's numbers after all ticks under these torques."""
        plant = Plant(self._robot, self.settings, PERIOD)
        for tick in range(self.settings.ticks):
            plant.step(Command(tick, acting(tick)))
        numbers: Array = plant.truth.numbers.copy()
        return numbers

    @property
    def numbers(self) -> Array:
        """Those of the true state that the loop's plant has come to."""
        numbers: Array = self.loop._plant.truth.numbers
        return numbers

    # of a node

    def log(self, text: str) -> None:
        self.logged.append(text)

    def report(self) -> None:
        pass

    def get_namespace(self) -> str:
        return "/"

    publishers: tuple[str, ...] = ()
    """Nodes that publish commands."""

    def count_publishers(self, topic: str) -> int:
        return len(self.publishers)

    def get_publishers_info_by_topic(self, topic: str) -> list[SimpleNamespace]:
        return [SimpleNamespace(node_namespace="/", node_name=name) for name in self.publishers]

    @property
    def context(self) -> SimpleNamespace:
        return SimpleNamespace(get_domain_id=lambda: 7)


Make = Callable[..., Bench]


@pytest.fixture
def make(paper_robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Make:
    return partial(Bench, paper_robot, monkeypatch)


def torque(tick: int) -> Array:
    """Another one each tick."""
    return np.linspace(0.1, 0.9, 9) * (1 + tick % 5)


def always(tick: int) -> bool:
    return True


def test_in_lockstep_every_tick_waits_for_its_answer_and_no_longer(make: Make) -> None:
    bench = make(always)
    bench.run()
    assert [tick for tick, _ in bench.states] == list(range(100))
    assert bench.waited_s == 0.0
    np.testing.assert_array_equal(bench.numbers, bench.flown_by_hand(torque))
    clock = ClockCodec()
    expected = [
        clock.encode(bench.settings.timebase.stamp_ns(k)) for k in range(0, 100, DECIMATION)
    ]
    assert bench.by_name[topics.CLOCK.name].sent == expected
    health = bench.loop.health()
    assert (health.mode, health.level) == ("nominal", Level.OK)
    assert health.values["missed_deadlines"] == 0
    assert health.values["held_ticks"] == 1


def test_without_an_answer_it_asks_again_then_flies_by_the_clock_and_comes_back(make: Make) -> None:
    """Silent from tick 20 to 79: the last torque is held, then none; a tick lasts its period."""
    bench = make(lambda tick: not 20 <= tick < 80)
    bench.run(lambda: bench.tick == 21)
    asked = [when - 1000.0 for tick, when in bench.states if tick == 20]
    assert len(asked) == 1 + int(SILENCE_S / (ASK_AGAIN_S + loop.TIMEOUT_S))
    assert np.diff(asked).min() > ASK_AGAIN_S
    assert bench.now - 1000.0 == pytest.approx(SILENCE_S, abs=0.05)
    assert bench.logged == ["no command for 1 s: the controller is silent"]
    began = bench.now
    bench.run(lambda: bench.tick == 45)
    assert bench.now - began == pytest.approx(24 * PERIOD, abs=2 * PERIOD)
    assert bench.loop.health().mode == "holding the last good command"
    bench.run(lambda: bench.tick == 70)
    health = bench.loop.health()
    assert (health.mode[:4], health.level) == ("safe", Level.ERROR)
    bench.run()
    assert bench.logged[1:] == ["the controller answers again"]
    assert bench.loop.missed_deadlines == 60
    assert bench.now - began == pytest.approx(60 * PERIOD, abs=3 * PERIOD)

    def acting(tick: int) -> Array:
        if not 20 <= tick < 80:
            return torque(tick)
        return torque(19) if tick <= 19 + HOLD else np.zeros(9)

    np.testing.assert_array_equal(bench.numbers, bench.flown_by_hand(acting))


@pytest.mark.parametrize("realtime", [False, True])
def test_pauses_and_steps_leave_no_trace(make: Make, realtime: bool) -> None:
    """However long they last: no command is missed, no time is lost, none is asked for again."""
    bench = make(always, realtime=realtime)
    control = bench.loop.control
    bench.run(lambda: bench.tick == 30)
    for stop in (control.step, None):
        if stop is None:
            assert control.pause() is False
        else:
            control.pause()
        bench.run(lambda: control.is_held)
        assert bench.loop.health().mode == "paused"
        bench.now += 100.0
        held = control.tick
        if stop:
            assert stop(5) == 35
            bench.run(lambda: control.is_held)
            assert (held, control.tick) == (30, 35)
    sent = [tick for tick, _ in bench.states]
    assert sent == list(range(36))
    control.resume()
    before = bench.now
    bench.run()
    np.testing.assert_array_equal(bench.numbers, bench.flown_by_hand(torque))
    assert bench.loop.missed_deadlines == 0
    assert [tick for tick, _ in bench.states] == list(range(100))
    expected = 65 * PERIOD if realtime else 0.0
    assert bench.now - before == pytest.approx(expected, abs=3 * PERIOD)
    assert not any("behind" in text for text in bench.logged)


@pytest.mark.parametrize("first", [1, 50])
def test_by_the_wall_clock_a_late_command_acts_late(make: Make, first: int) -> None:
    """The answers of ten ticks do not come; the one before them is held. Tick 0 alone waits."""
    late = range(first, first + 10)
    bench = make(lambda tick: tick not in late, realtime=True)
    bench.run()
    assert bench.loop.missed_deadlines == 10
    assert bench.now - 1000.0 == pytest.approx(99 * PERIOD, abs=3 * PERIOD)
    expected = bench.flown_by_hand(lambda k: torque(first - 1 if k in late else k))
    np.testing.assert_array_equal(bench.numbers, expected)


def test_what_is_no_good_command_is_counted_and_does_not_act(make: Make) -> None:
    """Answers to other ticks and bytes of anything are passed over; NaN is an answer, but none."""

    def answer(tick: int) -> bool:
        if tick == 10:
            bench.send(3, torque(0))
            bench.send(tick + 50, torque(0))
            bench.by_name[topics.COMMAND.name].waiting.append(b"\0\1\0\0nothing")
        if tick == 20:
            bench.send(tick, np.full(9, np.nan))
        return tick != 20

    bench = make(answer)
    bench.run()
    values = bench.loop.health().values
    refused = {k: v for k, v in values.items() if k.startswith("refused")}
    assert refused.pop("refused: stamp") == 2
    assert refused.pop("refused: not finite") == 1
    assert list(refused.values()) == [1]
    assert values["missed_deadlines"] == 1
    assert bench.waited_s == 0.0
    expected = bench.flown_by_hand(lambda k: torque(19 if k == 20 else k))
    np.testing.assert_array_equal(bench.numbers, expected)


def test_at_the_end_the_actuators_are_left_at_zero(make: Make) -> None:
    bench = make(lambda tick: tick < 40)
    bench.run(lambda: bench.tick == 40)
    bench.loop.deactivate()
    assert bench.logged == ["flew 0.0200 s in 0.00 s"]
    bench.run(lambda: bench.tick == 42)
    assert not bench.loop._plant.state.applied_torque.any()


def test_a_controller_of_others_is_waited_for_and_discovered_by_all_before_the_first_state(
    make: Make,
) -> None:
    bench = make(always, own_controller=True, join_timeout=9.0)
    bench.run(lambda: bench.now > 1005.0)
    assert not bench.states
    assert bench.loop.health().mode == "waiting for a node that publishes command"
    bench.publishers = ("mine",)
    bench.run()
    assert bench.states[0][1] - 1005.0 == pytest.approx(pacing.DISCOVERY_S, abs=0.1)
    np.testing.assert_array_equal(bench.numbers, bench.flown_by_hand(torque))


@pytest.mark.parametrize("publishers", [(), ("mine",)])
def test_a_controller_of_others_that_does_not_come_ends_the_flight(
    make: Make, publishers: tuple[str, ...]
) -> None:
    """Or comes and never answers."""
    bench = make(lambda tick: False, own_controller=True, join_timeout=4.0)
    bench.publishers = publishers
    text = (
        r"no good command for tick 0 within 4 s \(join_timeout\): publishers of command in ROS "
        f"domain 7: {'/mine' if publishers else 'none'}$"
    )
    with pytest.raises(FlightError, match=text):
        bench.run()
    waited = 4.0 + (pacing.DISCOVERY_S if publishers else 0.0)
    assert bench.now - 1000.0 == pytest.approx(waited, abs=0.1)


@pytest.mark.parametrize("realtime", [False, True])
def test_a_controller_of_others_that_falls_silent_ends_the_flight(
    make: Make, realtime: bool
) -> None:
    """As a controller that is killed does."""
    bench = make(lambda tick: tick < 20, own_controller=True, realtime=realtime, ticks=10_000)
    bench.publishers = ("mine",)
    with pytest.raises(FlightError, match=r"no command for 1 s \(silence_timeout\) at .*: /mine"):
        bench.run()
    assert bench.tick * PERIOD == pytest.approx(1.0 if realtime else 0.01, abs=0.03)


def test_deadlines_are_whole_periods_apart_and_slip_only_when_hopelessly_missed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, period = 1000.0, 1e-3
    monkeypatch.setattr(time, "monotonic", lambda: now)
    clock = WallClock(period)
    clock.start(7)
    for later in (-20, 0, 1, 10**6):
        assert clock.left(7 + later) == pytest.approx((later + 1) * period, abs=1e-6)
    now += 0.9 * SLIP_S
    assert (clock.slip(7), clock.lost_time_s) == (0.0, 0.0)
    now += 0.2 * SLIP_S
    behind = 1.1 * SLIP_S - period
    assert clock.slip(7) == clock.lost_time_s == pytest.approx(behind)
    assert clock.left(7) == pytest.approx(0.0, abs=1e-9), "due now"
    assert clock.remark() == f"{behind:.3f} s behind the wall clock: time goes on from here"
    assert clock.remark() == ""
    moments, said, lost, in_all = [now], "", 0.0, clock.lost_time_s
    while now < 1020.0:  # a machine that is too slow
        now += 0.3
        if clock.slip(7) and (remark := clock.remark()):
            lost, in_all = clock.lost_time_s - in_all, clock.lost_time_s
            moments.append(now)
            said = remark.split(" behind")[0] + remark.split("clock")[1].split(":")[0]
    assert len(moments) == 1 + int(20.0 / (REMARK_S + 0.3))
    assert all(later - earlier >= REMARK_S for earlier, later in pairwise(moments))
    assert said == f"{lost:.3f} s in {moments[-1] - moments[-2]:.1f} s, {in_all:.3f} s in all"
