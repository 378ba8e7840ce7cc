"""All nodes in one process: how fast in lockstep, how punctual by the wall clock."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray

from space_robot.flight.graph.orchestrator import fly
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py import topics

from ..graph_flights import WARM_UP_TICKS
from ..measure import Options
from ..result import Beside, Result, Target

DURATION_S = 10.0
CLOCK_DURATION_S = 30.0
RATE_ASKED = Target(10_000.0, 12_000.0)
ANSWERED_ASKED = Target(99.9)
NEVER = -1


class Sent(NamedTuple):
    """When states and commands of the ticks after the warm-up were sent."""

    states: NDArray[np.int64]
    """(N,) ns."""
    commands: NDArray[np.int64]
    """(N,) ns; `NEVER` of ticks without a command."""
    period_ns: int

    @property
    def ticks_per_s(self) -> float:
        """Mean rate."""
        return float((len(self.states) - 1) / (self.states[-1] - self.states[0]) * 1e9)

    @property
    def answered(self) -> float:
        """Share of ticks that have a command, %."""
        return 100.0 * float(np.mean(self.commands != NEVER))

    @property
    def punctual(self) -> float:
        """Share of ticks whose command came within a period of their due time, %."""
        due = np.arange(len(self.states)) * self.period_ns
        due += (self.states - due).min()  # by the most punctual of them
        late = self.commands - due > self.period_ns
        return 100.0 * float(np.mean(~late & (self.commands != NEVER)))


def composed(options: Options) -> list[Result]:
    """10 s in lockstep beside four processes, and 30 s by the wall clock.

    A tick is answered if its command is there by its end; in time to the letter if that is no
    later than one period after it was due to begin, however late the ticks before it were.
    """
    count = options.batches(usual=5)
    one, four, by_clock = [], [], []
    lockstep, seconds = (0.5, 1.0) if options.short else (DURATION_S, CLOCK_DURATION_S)
    for k in range(count):
        options.progress(f"one process and four, then one by the wall clock, {k + 1} of {count}")
        one.append(_fly(FlightPlan(duration=lockstep, composed=True)).ticks_per_s)
        four.append(_fly(FlightPlan(duration=lockstep)).ticks_per_s)
        by_clock.append(_fly(FlightPlan(duration=seconds, composed=True, realtime=True)))
    return [
        Result(
            "composed graph", "ticks/s", tuple(one), target=options.asked(RATE_ASKED), better="more"
        ),
        Result(
            "composed graph",
            "ticks/s",
            tuple(one),
            Beside("four processes", tuple(four)),
            better="more",
        ),
        Result(
            "by the wall clock: ticks answered",
            "%",
            tuple(sent.answered for sent in by_clock),
            better="more",
            target=options.asked(ANSWERED_ASKED),
        ),
        Result(
            "by the wall clock: in time to the letter",
            "%",
            tuple(sent.punctual for sent in by_clock),
            better="more",
        ),
    ]


def _fly(plan: FlightPlan) -> Sent:
    flight = Flight(resolve(plan))
    with tempfile.TemporaryDirectory(prefix="space_robot_bench_") as folder:
        bag = Path(folder) / "bag"
        fly(flight, bag, lambda log: {"lost": log.lost, "ticks": log.ticks})
        states, commands = (
            _sending_times(bag / "bag_0.mcap", topic, flight)[WARM_UP_TICKS:]
            for topic in (topics.JOINT_STATES, topics.COMMAND)
        )
    return Sent(states, commands, flight.timebase.period_ns)


def _sending_times(file: Path, topic: topics.Topic, flight: Flight) -> NDArray[np.int64]:
    times = np.full(flight.ticks, NEVER, np.int64)
    with file.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=[topic.full_name]):
            times[flight.timebase.tick(message.log_time)] = message.publish_time
    return times
