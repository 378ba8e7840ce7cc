"""Replay of a bag: its states and references, answered anew by a supervisor in this process."""

from __future__ import annotations

import math
import time
from array import array
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.controller.supervisor import StateResponder
from space_robot_control.laws.base import LawError
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.law_history import as_data, within
from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import FlightError, InputError, MessageError, SpaceRobotError
from space_robot_msgs_py.samples import LawInForce, RobotState
from space_robot_msgs_py.simulated_time import LATEST_S, check_time, tick_from
from space_robot_msgs_py.topics import Topic
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

from ...console.progress import flight_progress
from ..compilation import compile_kernels
from ..flight_messages import answers
from .choice import ControllerChoice
from .comparison import CommandList, Comparison
from .recording import Recording, StateMessages

SHOW_TICKS = 500
AHEAD = 64
"""Messages of the reference that are looked through for one that overwrites earlier ones."""


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
    start_s: float = 0.0
    """Simulated time of the first state."""
    end_s: float = math.inf
    """Simulated time before which the last state lies."""
    remap: Mapping[str, str] = field(default_factory=dict)
    """Our topic by the bag's."""
    namespace: str | None = None
    """Namespace of the robot in the bag (None: the only one)."""
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
    error: SpaceRobotError | None
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
        flight, has_laws = self.recording.flight, bool(self.laws)
        if self.options.start_s > 0.0:
            yield (
                "it does not begin where the flight did: laws with memory start afresh, and every "
                "law takes over from the applied torque within 20 ms"
            )
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
        if not self.recording.is_whole:
            yield (
                "the bag is not whole: after a gap the controller has not been sent all that it "
                "was sent in flight"
            )


class RecordedLaws:
    """Puts in force, before each state, the law and gains that the controller had in flight."""

    def __init__(
        self,
        laws: Iterable[LawInForce],
        put: Callable[[LawInForce], None],
        start_again: Callable[[], None],
    ) -> None:
        """``laws``: by rising tick; ``start_again``: as a controller restarted in flight."""
        self._coming = deque(laws)
        self._put, self._start_again = put, start_again
        self._has_begun = False

    def before(self, tick: int) -> None:
        """Put in force the law of ``tick`` before its state is sent; call it for each tick."""
        due = []
        while self._coming and self._coming[0].tick <= tick:
            due.append(self._coming.popleft())
        if self._has_begun and any(law.is_first for law in due):
            self._start_again()
        if due:
            self._put(due[-1])
        self._has_begun = True


class ReferenceStream:
    """One half of the recorded reference, decoded as late as the flown controller needed it.

    A message that begins before others that were sent earlier overwrites their rows, as after a
    ``goto``: those are decoded before it.
    """

    def __init__(
        self,
        messages: Iterator[tuple[int, bytes]],
        decode: Callable[[bytes], tuple[int, NDArray[np.float64]]],
        add: Callable[[int, NDArray[np.float64]], None],
    ) -> None:
        self._messages, self._decode, self._add = messages, decode, add
        self._ahead: deque[tuple[int, bytes]] = deque()
        self._look_ahead()

    def feed(self, tick: int) -> None:
        """Decode what was sent for the ticks up to ``tick``."""
        while self._due <= tick:
            with suppress(MessageError):  # the flown controller could not use it either
                self._add(*self._decode(self._ahead.popleft()[1]))
            self._look_ahead()

    def _look_ahead(self) -> None:
        self._ahead.extend(islice(self._messages, AHEAD - len(self._ahead)))
        self._due = min((tick for tick, _ in self._ahead), default=math.inf)


class ReplayedController:
    """The controller's part of a node: references, laws, and the answer to each state."""

    def __init__(self, choice: ControllerChoice, recording: Recording, start: int) -> None:
        """Begin before the state of tick ``start``."""
        self._choice, robot = choice, choice.robot
        self.answers = CommandList(choice.names.commanded, recording.timebase)
        self._references = ReferenceBuffer(robot.n)
        codec = ReferenceCodec(robot.joint_names, recording.timebase)
        self._streams = [
            ReferenceStream(recording.references(topic, start), decode, add)
            for topic, decode, add in (
                (topics.REFERENCE_JOINTS, codec.decode_joints, self._references.add_joints),
                (topics.REFERENCE_BASE, codec.decode_base, self._references.add_base),
            )
        ]
        self._states = StateCodec(choice.names, recording.timebase)
        self._state = RobotState.allocate(robot.n)
        self.start_again()

    def start_again(self) -> None:
        """Begin with a fresh memory, as a controller that was started again in flight."""
        supervisor, self._laws, self._by_name = self._choice.build_supervisor()
        self._responder = StateResponder(
            supervisor, self._laws, self._references, self._choice.settings
        )

    def put(self, flown: LawInForce) -> None:
        """Put a law of the flight in force."""
        law = self._by_name[one_of(flown.name, self._by_name, "law", " in the bag")]
        self._choice.set_gains(law, flown)
        self._laws.choose(law)

    def answer(self, state: StateMessages) -> None:
        """Answer a state, if the controller takes it."""
        for stream in self._streams:
            stream.feed(state.tick)
        parts = zip(self._states.control_topics, state.messages, strict=True)
        for topic, data in answers(
            self._responder, self._references, self._states, parts, self._state
        ):
            if topic is topics.COMMAND:
                self.answers.add(data)


def replay(bag: str | Path, **options: Any) -> Replay:
    """Answer the states of a bag by a new controller, and compare its commands bit for bit.

    ``has_passed`` of the result is the verdict, ``report()`` is the output of ``replay --json``.

    Args:
        bag: folder of the recorded flight.
        options: those of `ReplayOptions`: ``controller``, ``gains``, ``parameters`` of the
            controller, ``start_s``, ``end_s``, ...

    Raises:
        InputError: bag or options cannot be used.
        FlightError: the controller failed at the first state.
    """
    allowed = [field.name for field in fields(ReplayOptions) if field.name != "bag"]
    for name in options:
        one_of(name, allowed, "option", " of replay")
    asked = ReplayOptions(as_path(bag, "bag"), **options)
    recording = Recording(asked.bag, asked.remap, asked.namespace)
    laws = recording.laws()
    choice = ControllerChoice(
        recording.flight, asked.controller, asked.gains, asked.parameters, asked.trust, laws
    )
    period = recording.timebase.period
    check_time(asked.start_s, "start")
    check_time(min(asked.end_s, LATEST_S), "end")
    start, stop = int(tick_from(asked.start_s, period)), tick_from(asked.end_s, period)
    recorded = recording.commands(choice.names.commanded)
    if recording.has_commands and not recording.is_finished and len(recorded.ticks):
        stop = min(stop, int(recorded.ticks[-1]) + 1)
    recorded = recorded.within(start, stop)
    states = required_parts(recording, choice), start, stop
    if next(recording.states(*states), None) is None:
        raise InputError(f"{asked.bag}: no states in the part to be replayed")
    laws = within(laws, start, stop)
    compile_kernels(bool(choice.names.actuators))
    controller = ReplayedController(choice, recording, start)
    in_force = RecordedLaws(
        laws if choice.follows_flight else (), controller.put, controller.start_again
    )
    is_partly_answered = recording.has_commands and not recording.answers_are_complete
    answered = set(recorded.ticks.tolist()) if is_partly_answered else ()
    ticks, skipped = array("q"), 0
    error: SpaceRobotError | None = None
    count = min(float(recording.states_count), stop - start)
    begin = time.perf_counter()
    with flight_progress(count * period, f"replay, {choice.law_name}") as show:
        try:
            for state in recording.states(*states):
                if is_partly_answered and state.tick not in answered:
                    skipped += 1
                    continue
                in_force.before(state.tick)
                ticks.append(state.tick)
                controller.answer(state)
                if len(ticks) % SHOW_TICKS == 0:
                    show((state.tick - start) * period)
        except (FlightError, LawError) as ended:
            if len(ticks) == 1:
                raise
            error = ended
        show(count * period)
    elapsed, played = time.perf_counter() - begin, np.array(ticks, np.int64)
    if error or not recording.is_finished:  # what came until then
        recorded = recorded.within(start, max(ticks, default=start) + 1)
    comparison = Comparison(
        choice.names.commanded,
        played,
        recorded,
        controller.answers.commands(),
        (*choice.names.thrusters, *recording.flight.get("prismatic_joints", ())),
        choice.names.torquers,
    )
    return Replay(asked, choice, recording, comparison, laws, skipped, elapsed, error)


def required_parts(recording: Recording, choice: ControllerChoice) -> tuple[Topic, ...]:
    """Return the parts of a state that the controller needs, all of which the bag has."""
    parts = StateCodec(choice.names, recording.timebase).control_topics
    if missing := [topic.full_name for topic in parts if topic not in recording.parts]:
        raise InputError(
            f"{recording.path}: no messages on {', '.join(missing)}, which a controller of these "
            "actuators needs"
        )
    return parts
