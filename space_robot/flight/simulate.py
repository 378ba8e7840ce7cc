"""Flights in this process, without ROS, with the same plant, mission and controller.

It is flown in blocks, so that one of any length needs the memory of one block (`fly_blocks`).
`simulate` is for those who need the whole flight as one log.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.law_changes import LawChanges
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.blocks import block_bounds, blocks_of
from space_robot_msgs_py.bag.flight_log import FlightLog, of_nan
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import Command, LawInForce, ReferenceChunk, RobotState
from space_robot_msgs_py.wire.clock import ClockCodec
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.controller_law import LawCodec
from space_robot_msgs_py.wire.controller_signals import SignalsCodec
from space_robot_msgs_py.wire.controller_telemetry import SIGNALS, TelemetryCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec
from space_robot_msgs_py.wire.truth_writer import TruthWriter

from ..processes.scratch_folder import ScratchFolder
from .closed_loop import close_loop, measured_ticks
from .message_loop import MessageLoop
from .plan import Flight

Array = NDArray[np.float64]

STRETCH_TICKS, STRETCH_OF_MESSAGES = 10_000, 1_000
"""Ticks flown between two looks at the world outside: in compiled code, message by message."""


class Messages:
    """Writes a flight's messages into a bag, as the nodes would send them."""

    def __init__(self, flight: Flight, recorder: BagRecorder) -> None:
        names, timebase = flight.plant.names, flight.timebase
        self.record, self._flight = recorder.record, flight
        self._states = StateCodec(names, timebase)
        self._truth = TruthWriter(names, timebase, flight.plant.truth_topics)
        self._commands = CommandCodec(names.commanded, timebase)
        self._references = ReferenceCodec(names.joints, timebase)
        self._telemetry = TelemetryCodec(names.axes)
        self._signals = SignalsCodec(names.axes, flight.timebase)
        self._clock = ClockCodec()
        self._law = LawCodec(timebase)
        from space_robot_sim.plant.scene import SceneWriter  # of no use without a bag

        self._scene = SceneWriter(flight.robot, timebase)
        self._record_all(self._scene.lasting())

    def begin_tick(self, tick: int) -> None:
        """Write the periodic messages: the reference from ``tick`` on, and the clock."""
        flight = self._flight
        chunk_ticks = flight.mission_settings.chunk_ticks
        if tick % chunk_ticks == 0:
            joints, base = self._references.encode(flight.mission.chunk(tick, chunk_ticks))
            self.record(topics.REFERENCE_JOINTS, joints)
            self.record(topics.REFERENCE_BASE, base)
        if tick % flight.plant_settings.clock_decimation == 0:
            self.record(topics.CLOCK, self._clock.encode(flight.timebase.stamp_ns(tick)))

    def update_true_state(self, state: RobotState) -> None:
        """Write the true state of a tick, with some before it."""
        self._record_all(self._truth.add(state))

    def show(self, tick: int, state_of: Callable[[int], RobotState]) -> None:
        """Write the poses of a tick's true state, if they are due."""
        if self._scene.is_due(tick):
            self._record_all(self._scene.poses(state_of(tick)))

    def end(self) -> None:
        """Write the buffered messages."""
        self._record_all(self._truth.flush())

    def _record_all(self, messages: Iterable[tuple[topics.Topic, bytes]]) -> None:
        for message in messages:
            self.record(*message)

    def stretch(self, log: FlightLog, start: int, stop: int, answered: int) -> None:
        """Write what mission, plant and controller send in the ticks ``start`` to ``stop``.

        All of them are in ``log``; the controller answers those before ``answered``.
        """
        assert log.commanded_torque is not None
        assert log.telemetry is not None
        record, flight = self.record, self._flight
        laws = [law for law in log.laws if start <= law.tick < stop]
        measured, true_states = log.as_measured(), log.states(start, stop)
        for tick, state in enumerate(measured.states(start, stop), start):
            self.begin_tick(tick)
            parts = self._states.encode(state)
            for topic, data in zip(self._states.topics, parts, strict=True):
                record(topic, data)
            if flight.plant.truth_topics:
                self.update_true_state(next(true_states))
            self.show(tick, log.state)
            if tick >= answered:
                continue
            row = tick - log.first_tick
            torque = np.concatenate((log.commanded_torque[row], log.actuator_commands[row]))
            record(topics.COMMAND, self._commands.encode(Command(tick, torque)))
            if laws and laws[0].tick == tick:
                record(topics.LAW, self._law.encode(laws.pop(0)))
            if tick % flight.controller_settings.telemetry_decimation == 0:
                if np.isnan(log.telemetry[row]).all():  # the law was not asked, on a bench
                    continue
                s, u, n_hat, e = log.telemetry[row]
                record(topics.TELEMETRY, self._telemetry.encode(tick, (s, u, n_hat, e)))
                record(topics.SIGNALS, self._signals.encode(tick, e, s, n_hat))


@contextmanager
def _recording(flight: Flight, bag: Path | None) -> Iterator[Messages | None]:
    if bag is None:
        yield None
        return
    settings = flight.scenario.recorder
    recorder = BagRecorder(
        bag, flight.description, flight.timebase, settings.compression, settings.split_size
    )
    messages = Messages(flight, recorder)
    try:
        yield messages
    finally:
        messages.end()
        recorder.close()


def empty_log(
    flight: Flight,
    start: int = 0,
    stop: int | None = None,
    new: Callable[[tuple[int, ...]], Array] = of_nan,
    reference: ReferenceChunk | None = None,
    is_brief: bool = False,
) -> FlightLog:
    """Return the log of the ticks ``start`` to ``stop`` (None: the last) before the flight.

    The reference alone is known; it may have been computed. ``new`` makes the columns that the
    flight fills. ``is_brief``: with what metrics need only, see `Flight.brief`.
    """
    log = columns_of(flight, (flight.ticks if stop is None else stop) - start, new, is_brief)
    log.first_tick = start
    log.flight = flight.brief if is_brief else flight.description
    log.lost = {topic.full_name: 0 for topic in topics.ALL}
    reference = reference or flight.mission.chunk(start, log.ticks)
    log.reference_joints, log.reference_base = reference.joints, reference.base
    return log


def columns_of(
    flight: Flight,
    ticks: int,
    new: Callable[[tuple[int, ...]], Array] = of_nan,
    is_brief: bool = False,
) -> FlightLog:
    """Return the columns of a log, see `empty_log`; if ``is_brief``, of true states only."""
    names = flight.plant.names
    counts = len(names.wheels), len(names.thrusters)
    log = FlightLog.allocate(
        ticks,
        names.joints,
        flight.timebase,
        *counts,
        names.passive,
        names.geared,
        names.in_orbit,
        new,
        len(names.torquers),
    )
    if is_brief:
        return log
    log.commanded_torque = new(log.applied_torque.shape)
    log.telemetry = new((ticks, 4, log.axes))
    if not flight.plant.measures_truth:
        log.record_measured(new)
    return log


def fly_blocks(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[int], None] = lambda tick: None,
    block_of: Callable[[int, int], FlightLog] | None = None,
) -> Generator[FlightLog, None, None]:
    """Fly every tick of ``flight`` and yield the logs, block by block.

    A flight that ends early hands out the block it ended in, up to the last state that was
    measured, before the error is raised; a state that was not answered has a command of NaN. All
    that was flown is then in the bag.

    A flight whose messages fail is handed out as its bag tells it, once it is over.

    Args:
        flight: a checked plan; its plant is flown on from where it stands.
        bag: where to write the messages the graph would have sent (None: nowhere).
        progress: called now and then with the ticks flown.
        block_of: the log to write the ticks from the first to before the second into, whose
            reference is filled in (None: a new one for every block).

    Raises:
        FlightError: the flight diverged or met a singular attitude; the bag is closed.
        InputError: the bag cannot be written, or the flight needs a graph of nodes.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        yield from _fly_by_messages(flight, bag, progress)
        return
    block_of = block_of or (lambda start, stop: empty_log(flight, start, stop))
    laws: tuple[LawInForce, ...] = ()
    changes = LawChanges()
    with _recording(flight, bag) as messages:
        for start, stop in block_bounds(flight.ticks):
            block = block_of(start, stop)
            block.laws = laws
            try:
                _fly_block(flight, block, changes, messages, progress)
            except Exception as error:
                measured = measured_ticks(flight.plant, error)
                yield ended_early(block, measured - start, flight.plant.tick - start)
                raise
            yield block
            laws = block.laws
    progress(flight.ticks)


def record(flight: Flight, log: FlightLog, bag: Path) -> None:
    """Write a flown flight into a bag, with the messages that `fly_blocks` would have written.

    Args:
        flight: that was flown.
        log: of all its ticks, in memory.
        bag: folder to write.

    Raises:
        InputError: the bag cannot be written.
    """
    answered = log.ticks - log.unanswered
    with _recording(flight, bag) as messages:
        assert messages
        for block in blocks_of(log):
            start, stop = block.first_tick, block.first_tick + block.ticks
            messages.stretch(block, start, stop, min(stop, answered))


def simulate(
    flight: Flight, bag: Path | None = None, progress: Callable[[int], None] = lambda tick: None
) -> FlightLog:
    """Fly a flight into one log; see `fly_blocks`.

    Raises:
        FlightError: as there; its ``log`` is what was flown.
        InputError: as there, or a log of the whole flight would not fit into memory.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        return _flown_by_messages(flight, bag, progress)
    check_memory(flight, flight.ticks)
    log, flown = empty_log(flight), 0
    try:
        for block in fly_blocks(flight, bag, progress, log.rows):
            flown += block.ticks
            log.unanswered, log.laws = block.unanswered, block.laws
    except FlightError as error:
        error.log = log.rows(0, flown)
        raise
    return log


def _fly_by_messages(
    flight: Flight, bag: Path | None, progress: Callable[[int], None]
) -> Iterator[FlightLog]:
    try:
        log = _flown_by_messages(flight, bag, progress)
    except FlightError as error:
        if error.log:
            yield from blocks_of(error.log)
        raise
    yield from blocks_of(log)


def _flown_by_messages(
    flight: Flight, bag: Path | None, progress: Callable[[int], None]
) -> FlightLog:
    """Fly by `MessageLoop` into a bag, and read the bag."""
    with ScratchFolder() as folder:
        path = bag or Path(folder) / "bag"
        try:
            with _recording(flight, path) as messages:
                assert messages
                loop = MessageLoop(flight, messages.record, messages.update_true_state)
                for tick in range(flight.plant.tick, flight.ticks):
                    if tick % STRETCH_OF_MESSAGES == 0:
                        progress(tick)
                    messages.begin_tick(tick)
                    messages.show(tick, lambda _: flight.plant.truth)
                    loop.fly_tick()
        except FlightError as error:
            error.log = read_flight(path, trust=True)
            raise
        progress(flight.ticks)
        return read_flight(path, trust=True)


def _fly_block(
    flight: Flight,
    block: FlightLog,
    changes: LawChanges,
    messages: Messages | None,
    progress: Callable[[int], None],
) -> None:
    plant, controller, swaps = flight.plant, flight.controller, dict(flight.swaps)
    first, end = block.first_tick, block.first_tick + block.ticks
    cuts = {*range(first, end, STRETCH_TICKS), *(k for k in swaps if first <= k < end), end}
    for start, stop in itertools.pairwise(sorted(cuts)):
        progress(start)
        if start in swaps and swaps[start].name != controller.law.name:
            controller.law = swaps[start]
        if change := changes.at(start, controller.law):
            block.laws += (change.law,)
        try:
            close_loop(plant, controller, block, start, stop)
        except Exception as error:
            note_assumed_errors(flight, block, start, plant.tick)
            if messages:
                messages.stretch(block, start, measured_ticks(plant, error), plant.tick)
            raise
        note_assumed_errors(flight, block, start, stop)
        if messages:
            messages.stretch(block, start, stop, stop)


def note_assumed_errors(flight: Flight, block: FlightLog, start: int, stop: int) -> None:
    """Copy the errors in the law's telemetry of the ticks ``start`` to ``stop``."""
    if block.assumed_error is None:
        return
    assert block.telemetry is not None
    every = flight.controller_settings.telemetry_decimation
    rows = slice(-(-start // every) * every - block.first_tick, stop - block.first_tick, every)
    block.assumed_error[rows] = block.telemetry[rows, SIGNALS.index("e")]


def ended_early(block: FlightLog, measured: int, answered: int) -> FlightLog:
    """The first ``measured`` rows; those from ``answered`` on have no command."""
    for column in (block.commanded_torque, block.actuator_commands, block.telemetry):
        if column is not None:
            column[answered:] = np.nan
    block.unanswered = measured - answered
    block.laws = tuple(law for law in block.laws if law.tick < block.first_tick + answered)
    return block.rows(0, measured)


def check_memory(flight: Flight, ticks: int) -> None:
    """Check that a log of the first ``ticks`` of a flight fits into memory.

    Raises:
        InputError: the log does not fit.
    """
    from ..processes.memory import available_bytes

    needed, free = ticks * row_bytes(flight), available_bytes()
    if needed > free:
        raise InputError(
            f"duration {ticks * flight.period:g} s: the whole flight in memory needs "
            f"{needed / 1e9:.1f} GB, {free / 1e9:.1f} GB are free: fly a shorter one"
        )


def row_bytes(flight: Flight) -> int:
    """Return the size of a tick in a log."""
    row = empty_log(flight, 0, 1)
    columns = [*row.columns.values(), *(row.measured.columns.values() if row.measured else ())]
    return sum(column.nbytes for column in columns)
