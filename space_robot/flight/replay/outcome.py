"""The options of a replay, and its outcome."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from space_robot_msgs_py.bag.law_history import as_data
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import LawInForce

from .choice import ControllerChoice
from .comparison import Comparison
from .recording import Recording


@dataclass(frozen=True)
class ReplayOptions:
    """Options of a replay."""

    bag: Path
    controller: str = ""
    """Law that answers (empty: the recorded one)."""
    gains: str = ""
    """Gains of the law (empty: the recorded ones)."""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """Further parameters of the controller."""
    rate: float | None = None
    """Times real time, by the wall clock (None: lockstep)."""
    start_s: float = 0.0
    """Simulated time of the first state."""
    end_s: float = math.inf
    """Simulated time before which the last state lies."""
    remap: Mapping[str, str] = field(default_factory=dict)
    """Our topic by the bag's."""
    namespace: str | None = None
    """Namespace of the robot in the bag (None: the only one)."""
    domain: int | None = None
    trust: bool = False
    """True if modules and files that the bag names may be opened."""


@dataclass(frozen=True)
class Replay:
    """The outcome of a replay."""

    options: ReplayOptions
    choice: ControllerChoice
    recording: Recording
    comparison: Comparison
    laws: tuple[LawInForce, ...]
    """Laws in force in the replayed part of the flight."""
    skipped: int
    """States that the controller did not answer in flight, and was not sent now."""
    elapsed_s: float
    error: FlightError | None
    """Error that ended the replay early."""

    @property
    def is_judged(self) -> bool:
        """True if the commands are to be the recorded ones."""
        return self.choice.is_as_flown and self.recording.has_commands

    @property
    def has_passed(self) -> bool:
        """True if nothing is other than expected; another law is not expected to agree.

        A bag that is unfinished, or has lost something, does not pass.
        """
        is_same = self.comparison.is_identical and self.recording.is_whole
        return self.error is None and (is_same or not self.is_judged)

    @property
    def differs(self) -> bool:
        """True if a command differs though the controller was sent all that it was in flight.

        After a gap in a damaged bag it was not, and may command something else.
        """
        first = self.comparison.first_difference()
        return first is not None and first[0] < self.recording.first_gap

    def report(self) -> dict[str, Any]:
        """The report, for JSON and the table."""
        flight, options = self.recording.flight, self.options
        numbers = self.comparison.report(self.recording.timebase.period)
        return {
            "bag": str(options.bag),
            "recorded": {
                **{key: flight.get(key) for key in ("controller", "gains", "swaps")},
                "laws": as_data(self.laws, self.recording.timebase),
            },
            "replayed": {
                "controller": self.choice.law_name,
                "gains": self.choice.gains_name,
                "swaps": self.choice.swaps,
                "as_in_flight": bool(self.choice.follows_flight and self.laws),
                "set": dict(options.parameters),
            },
            "lockstep": options.rate is None,
            "rate": options.rate,
            "start_s": options.start_s,
            "end_s": options.end_s if math.isfinite(options.end_s) else None,
            **numbers,
            "has_commands": self.recording.has_commands,
            "judged": self.is_judged,
            "differs": self.differs,
            "first_gap_s": self._seconds(self.recording.first_gap),
            "whole": self.recording.is_whole,
            "unfinished": self.recording.unfinished,
            "damage": list(self.recording.damage),
            "passed": self.has_passed,
            "reasons": [*self._reasons()],
            "skipped": self.skipped,
            "elapsed_s": self.elapsed_s,
            "ticks_per_s": numbers["played"] / self.elapsed_s if self.elapsed_s else None,
            "error": str(self.error) if self.error else None,
        }

    def _seconds(self, tick: float) -> float | None:
        return round(tick * self.recording.timebase.period, 9) if math.isfinite(tick) else None

    def _reasons(self) -> Iterator[str]:
        """Yield reasons why an unchanged controller may give different bits."""
        flight, has_laws = self.recording.flight, bool(self.laws)
        if self.options.start_s > 0.0:
            yield (
                "it does not begin where the flight did: laws with memory start afresh, and every "
                "law takes over from the applied torque within 20 ms"
            )
        if self.options.rate is not None:
            yield "by the wall clock the controller may miss states, and a law's memory with them"
        faults = " ".join(flight.get("faults", []))
        if not has_laws and (flight.get("restart_controller") or "_controller" in faults):
            yield "the controller was stopped or started again in flight, the replayed one is not"
        if not has_laws:
            yield "the bag has no record of laws and gains changed in flight with `ros2 param set`"
        if lost := self.recording.lost_commands:
            yield (
                f"the recorder missed {lost} commands: the states that they answered are not known,"
                " and the replayed controller was not sent them"
            )
        if "_mission" in faults:
            yield "the mission was killed or stopped: references may have come late in flight"
        if not flight:
            law = "" if has_laws else "law, gains, "
            yield f"the bag does not say what was flown: {law}robot and parameters are a guess"
        elif "parameters" not in flight:
            yield "the bag is an older one: parameters changed with --set are not in it"
        if not self.recording.is_whole:
            yield (
                "the bag is not whole: after a gap the controller has not been sent all that it "
                "was sent in flight"
            )
