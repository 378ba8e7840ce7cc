"""Replay of a bag: start a controller, play, compare, report."""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from space_robot_msgs_py.bag.law_history import within
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import LawInForce
from space_robot_msgs_py.simulated_time import LATEST_S, check_time, tick_from
from space_robot_msgs_py.topics import Topic
from space_robot_msgs_py.wire.codecs import StateCodec

from ...console.progress import FlightProgress, flight_progress
from ...processes.scratch_folder import ScratchFolder
from ..compilation import compile_kernels
from ..graph.domain import ros_domain
from ..graph.following import InterruptedFlightError
from ..graph.node_services import change_state, set_parameters
from ..graph.orchestrator import require_ros, stop_signals
from ..graph.processes import Graph, NodeProcess, node_command, node_environment
from .choice import ControllerChoice
from .commands import CommandList, ReplayedCommands, Ticks
from .comparison import Comparison
from .outcome import Replay, ReplayOptions
from .player import CONTROLLER, REFERENCES, Player
from .recording import Recording, StateMessages

SHOW_S = 0.2


class RecordedLaws:
    """Sets, before each state, the law and gains that the live controller had in flight.

    In flight they changed between two states, too, so the replayed controller takes over, and
    remembers, as the flown one did. Independent of ROS.
    """

    def __init__(
        self,
        laws: Iterable[LawInForce],
        put: Callable[[LawInForce], None],
        start_again: Callable[[], None],
    ) -> None:
        """Begin before the first state.

        Args:
            laws: by rising tick.
            put: puts a law in force; returns when that has been done.
            start_again: gives the controller a fresh memory, as a restart did in flight.
        """
        self._coming = deque(laws)
        self._put, self._start_again = put, start_again
        self._has_begun = False

    def before(self, tick: int) -> None:
        """Put in force the law of ``tick`` before its state is sent; call it for each tick."""
        if not self._coming or self._coming[0].tick > tick:
            self._has_begun = True
            return
        due = [self._coming.popleft()]
        while self._coming and self._coming[0].tick <= tick:
            due.append(self._coming.popleft())
        if self._has_begun and any(law.is_first for law in due):
            self._start_again()
        self._put(due[-1])
        self._has_begun = True


def replay(options: ReplayOptions) -> Replay:
    """Play a bag to a new controller and compare its commands with the recorded ones.

    Raises:
        InputError: bag or options cannot be used; nothing was started.
        FlightError: the controller did not start.
    """
    recording = Recording(options.bag, options.remap, options.namespace)
    laws = recording.laws()
    with ScratchFolder() as folder:
        choice = ControllerChoice(
            recording.flight,
            Path(folder),
            options.controller,
            options.gains,
            options.parameters,
            options.trust,
            laws,
        )
        require_ros()
        return _Run(options, recording, choice, laws).run()


class _Run:
    def __init__(
        self,
        options: ReplayOptions,
        recording: Recording,
        choice: ControllerChoice,
        laws: Sequence[LawInForce],
    ) -> None:
        self._options, self._recording, self._choice = options, recording, choice
        period = recording.timebase.period
        check_time(options.start_s, "start")
        check_time(min(options.end_s, LATEST_S), "end")
        self._start = int(tick_from(options.start_s, period))
        self._stop = tick_from(options.end_s, period)
        self._recorded = self._read_commands()
        self._parts = self._choose_parts()
        if next(recording.states(self._parts, self._start, self._stop), None) is None:
            raise InputError(f"{options.bag}: no states in the part to be replayed")
        self._laws = within(laws, self._start, self._stop)
        self._skipped = 0
        self._progress: FlightProgress | None = None
        self._shown_at = 0.0

    def _choose_parts(self) -> tuple[Topic, ...]:
        """Return the parts of a state that the controller needs."""
        parts = StateCodec(self._choice.names, self._recording.timebase).control_topics
        if lacking := [topic.full_name for topic in parts if topic not in self._recording.parts]:
            raise InputError(
                f"{self._options.bag}: no messages on {', '.join(lacking)}, which a controller of "
                "these actuators needs"
            )
        return parts

    def _read_commands(self) -> ReplayedCommands:
        """Return the commands to compare with, up to the last one of an unfinished bag."""
        recording = self._recording
        commands = recording.commands(self._choice.names.commanded)
        if recording.has_commands and not recording.is_finished and len(commands.ticks):
            self._stop = min(self._stop, int(commands.ticks[-1]) + 1)
        return commands.within(self._start, self._stop)

    def run(self) -> Replay:
        """Start the controller, play, stop it, compare."""
        options, recording, choice = self._options, self._recording, self._choice
        names, error = choice.names.commanded, None
        answers = CommandList(names, recording.timebase)
        parameters = dict(choice.parameters)
        if options.rate is None and "reference_timeout" not in options.parameters:
            # there is time to wait; by the wall clock, where the flight may have been, there is not
            parameters.pop("reference_timeout", None)
        compile_kernels(bool(choice.names.actuators))
        command = {"controller": node_command("controller", {**parameters, "autostart": False})}
        with (
            ros_domain(options.domain) as domain,
            stop_signals() as stopped,
            Player(domain, answers, self._parts) as player,
            Graph(command, node_environment(domain)) as graph,
        ):
            controller = graph.nodes["controller"]
            player.check = lambda: _check(controller, stopped)
            _bring_up(controller, player)
            begin = time.perf_counter()
            with self._show() as show, _frozen():
                try:
                    self._play(player, show)
                except FlightError as ended:
                    error = ended
            elapsed = time.perf_counter() - begin
        played = player.played
        if error and not len(played):
            raise error
        forces = *choice.names.thrusters, *recording.flight.get("prismatic_joints", ())
        comparison = Comparison(
            names,
            played,
            self._recorded_until(played, error),
            answers.commands(),
            forces,
            choice.names.torquers,
        )
        return Replay(
            options, choice, recording, comparison, self._laws, self._skipped, elapsed, error
        )

    def _recorded_until(self, played: Ticks, error: FlightError | None) -> ReplayedCommands:
        """Take of a replay, or a bag, that ended early only what came until then."""
        if error is None and self._recording.is_finished:
            return self._recorded
        return self._recorded.within(self._start, int(played.max()) + 1)

    def _play(self, player: Player, show: Callable[[int], None]) -> None:
        states = self._states()
        references = [self._recording.references(topic, self._start) for topic in REFERENCES]
        laws = RecordedLaws(
            self._laws if self._choice.follows_flight else (),
            lambda law: set_parameters(
                player.node, CONTROLLER, self._choice.law_parameters(law), player.check
            ),
            lambda: _start_again(player),
        )
        if self._options.rate is None:
            player.lockstep(states, references, laws.before, show)
        else:
            period = self._recording.timebase.period / self._options.rate
            player.by_the_clock(states, references, laws.before, show, period)

    def _states(self) -> Iterator[StateMessages]:
        """Return the states that the controller answered."""
        recording = self._recording
        states = recording.states(self._parts, self._start, self._stop)
        if not recording.has_commands or recording.answers_are_complete:
            yield from states
            return
        answered = set(self._recorded.ticks.tolist())
        for state in states:
            if state.tick in answered:
                yield state
            else:
                self._skipped += 1

    @contextmanager
    def _show(self) -> Iterator[Callable[[int], None]]:
        period = self._recording.timebase.period
        count = min(float(self._recording.states_count), self._stop - self._start)
        with flight_progress(count * period, f"replay, {self._choice.law_name}") as progress:

            def show(tick: int) -> None:
                now = time.monotonic()
                if now > self._shown_at + SHOW_S:
                    self._shown_at = now
                    progress((tick - self._start) * period)

            yield show
            progress(count * period)


def _bring_up(controller: NodeProcess, player: Player) -> None:
    if refused := _change_state(player, "configure", "activate"):
        raise FlightError(f"{CONTROLLER} refused to {refused}:\n{controller.output_tail()}")
    player.wait_for_controller()


def _start_again(player: Player) -> None:
    """Reset the controller, as a restart in flight does."""
    if refused := _change_state(player, "deactivate", "cleanup", "configure", "activate"):
        raise FlightError(f"{CONTROLLER} refused to {refused}")
    player.resend_pending()


def _change_state(player: Player, *transitions: str) -> str:
    """Request transitions of the controller; return the first refused one, or None."""
    for transition in transitions:
        if change_state(player.node, [CONTROLLER], transition, player.check):
            return transition
    return ""


def _check(controller: NodeProcess, stopped: list[int]) -> None:
    if stopped:
        raise InterruptedFlightError("the replay was stopped", stopped[0])
    if controller.exit_code is not None:
        raise FlightError(
            f"{controller.exit_summary()} before the replay was over:\n{controller.output_tail()}"
        )


@contextmanager
def _frozen() -> Iterator[None]:
    """Exclude existing objects from garbage collection during the replay."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
