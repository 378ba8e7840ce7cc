"""Reader of a bag into a `FlightLog`, also for bags of other recorders."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..config.text import printable
from ..errors import InputError, MessageError
from ..samples import (
    ACTUATOR_FIELDS,
    MOST_PASSIVE,
    PASSIVE_FIELDS,
    STATE_FIELDS,
    RobotNames,
    Timebase,
)
from ..wire.definitions import decode
from .batch import Batch
from .description import read_description
from .flight_log import REFERENCE, FlightLog, MeasuredStates, finite_rows
from .folder import Bag, open_bag
from .message_accounting import (
    LONGEST_JUMP,
    Account,
    MessageAccounting,
    lost_messages,
    noted_accounts,
    topics_with_allowed_gaps,
    unanswered_ticks,
)
from .rows import Rows
from .selection import REQUIRED, Selection

DEFAULT_PERIOD = 0.0005
"""Period of a bag without a description, s."""
_STAMPS_READ = 200
_STRETCHES = 3
"""Maximum number of listed stretches without a whole tick."""


def read_flight(
    path: Path,
    remap: Mapping[str, str] | None = None,
    trust: bool = False,
    namespace: str | None = None,
) -> FlightLog:
    """Read a flight; damaged parts are left out and reported in `FlightLog.damage`.

    Ticks between the first and the last that have no whole state and reference are NaN. Of a bag
    that nobody finished (`FlightLog.unfinished`) what is there is read.

    Args:
        path: the folder of a rosbag2 bag, or a single .mcap or .db3 file.
        remap: our topic by the bag's, as in ``{"/arm/joint_states": "/joint_states"}``.
        trust: whether files and modules that its description names may be opened by those who
            ask for more than the bag holds (`FlightLog.trusted`); here none is opened.
        namespace: of the robot to be read, as ``/sat1``; None: of the only one in the bag.

    Raises:
        InputError: no bag is there, it cannot be read, a needed topic is missing, empty, or of
            another type, it has several robots, or not one tick is whole. One line.
    """
    try:
        log = _read(open_bag(Path(path)), remap or {}, namespace)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except InputError as error:
        text = printable(str(error))
        raise InputError(text if str(path) in text else f"{path}: {text}") from None
    log.trusted = trust
    return log


def _read(bag: Bag, remap: Mapping[str, str], namespace: str | None) -> FlightLog:
    selection = Selection(bag, remap, namespace)
    damage: list[str] = []
    flight: dict[str, Any] = {}
    try:
        flight = read_description(bag.custom_data())
    except InputError as error:
        damage.append(str(error))
    rows = _empty_rows(bag, selection, flight, damage)
    for topic, batch in selection.batches():
        rows.take(topic, batch)
    for topic in REQUIRED:
        if not rows.counts[topic.full_name]:
            raise missing(topic, bag, selection)
    rows.split_truth()
    log, excused = rows.log, topics_with_allowed_gaps(flight)
    log.flight, log.namespace = flight, selection.namespace
    recorded = selection.recorded() or {}
    unread = {name: recorded[name] - rows.counts[name] for name in recorded}
    unread = {name: count for name, count in unread.items() if count > 0}
    accounts = noted_accounts(bag.custom_data())
    _count_lost(bag, selection, rows, unread, accounts)
    if excused and not (bag.incomplete or any(log.lost[topic.full_name] for topic in REQUIRED)):
        fill_gaps(log)
    whole = log.whole
    ticks = len(whole) - int(np.argmax(whole[::-1])) if whole.any() else 0
    damage += bag.damage
    if unread:
        each = ", ".join(f"{name} {count}" for name, count in unread.items())
        of_all = f"{sum(unread.values())} of {sum(recorded.values())} recorded messages"
        damage.append(f"{of_all} cannot be read: {each}")
    damage += [f"{name} is left out: {wrong}" for name, wrong in selection.wrong.items()]
    damage += rows.anomalies(bool(excused))
    if inactive := {name: a.while_inactive for name, a in accounts.items() if a.while_inactive}:
        each = ", ".join(f"{name} {count}" for name, count in inactive.items())
        damage.append(f"messages were sent while the recorder was inactive: {each}")
    half = [topic.full_name for topic in topics.TRUTH if rows.counts[topic.full_name]]
    if len(half) == 1:
        damage.append(
            f"of the true states only {half[0]} is there: the measured ones are taken for them"
        )
    if not ticks:
        context = "; ".join(_not_finished(bag) + damage)
        raise InputError(f"not one tick with its state and reference ({context})")
    damage += missing_ticks(whole[:ticks], log.timebase)
    log.damage = tuple(printable(text) for text in damage)
    if not bag.finished:
        last_s = log.timebase.stamp_ns(ticks - 1) / 1e9
        log.unfinished = f"the bag was not finished: read up to t = {last_s:.4f} s"
    return rows.finish(ticks)


def fill_gaps(log: FlightLog) -> None:
    """Give ticks without a usable state the one before, and missing references the last point.

    From the first whole tick to the last state; `FlightLog.filled` counts the states. Only what
    the sensors report is filled in: the truth has no such gaps.
    """
    measured = log if log.measured is None else log.measured
    states = finite_rows(getattr(measured, name) for name in STATE_FIELDS)
    known = log.finite(STATE_FIELDS) | states
    end = len(known) - int(np.argmax(known[::-1])) if known.any() else 0
    log.filled = int(np.count_nonzero(~states[:end]))
    _repeat_before(measured, STATE_FIELDS, states, end)
    passive = finite_rows(getattr(measured, name) for name in PASSIVE_FIELDS)
    _repeat_before(measured, PASSIVE_FIELDS, passive, end)
    _repeat_before(log, ACTUATOR_FIELDS, log.finite(ACTUATOR_FIELDS), end)
    references = log.finite(REFERENCE)
    _repeat_before(log, REFERENCE, references, end)
    log.reference_joints[:end][~references[:end], 1:] = 0.0  # at rest
    log.reference_base[:end][~references[:end], 4:] = 0.0


def _repeat_before(
    log: FlightLog | MeasuredStates, columns: tuple[str, ...], good: NDArray[np.bool_], end: int
) -> None:
    source = np.maximum.accumulate(np.where(good[:end], np.arange(end), -1))
    bad = np.flatnonzero(~good[:end] & (source >= 0))
    for name in columns:
        column: Any = getattr(log, name)
        column[bad] = column[source[bad]]


def missing_ticks(whole: NDArray[np.bool_], timebase: Timebase) -> list[str]:
    """Describe the ticks without state or reference; ``whole`` (N,) is true for others."""
    edges = np.diff(np.concatenate(([True], whole, [True])).astype(np.int8))
    starts, stops = np.flatnonzero(edges < 0), np.flatnonzero(edges > 0)
    if not len(starts):
        return []
    spans = [
        f"{timebase.stamp_ns(int(start)) / 1e9:.4f} to {timebase.stamp_ns(int(stop) - 1) / 1e9:.4f}"
        for start, stop in zip(starts[:_STRETCHES], stops, strict=False)
    ]
    rest = len(starts) - _STRETCHES
    more = f", and {rest} stretches more" if rest > 0 else ""
    count = f"{np.count_nonzero(~whole)} of {len(whole)} ticks"
    return [f"{count} lack state or reference: t = {', '.join(spans)} s{more}"]


def first_states(bag: Bag, selection: Selection) -> tuple[RobotNames, list[int]]:
    """Return the names of the joints, and the first stamps in ns."""
    names: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()
    """The joints of the first reference that names no others; the rest have no motor."""
    referenced: list[tuple[str, ...]] = []
    stamps: list[int] = []
    for topic, batch in selection.batches():
        if topic is topics.JOINT_STATES:
            names = names or next(_joint_names(topic, batch), ())
            stamps += batch.stamps.tolist()
        elif topic is topics.REFERENCE_JOINTS and not moved:
            referenced += dict.fromkeys(_joint_names(topic, batch))
        moved = next((known for known in referenced if known and set(known) <= set(names)), ())
        if len(stamps) >= _STAMPS_READ and moved:
            break
    if not names:
        raise missing(topics.JOINT_STATES, bag, selection)
    passive = tuple(name for name in names if name not in moved) if moved else ()
    if len(passive) > MOST_PASSIVE:
        passive = ()
    return RobotNames(tuple(name for name in names if name not in passive), passive=passive), stamps


def _empty_rows(bag: Bag, selection: Selection, flight: dict[str, Any], damage: list[str]) -> Rows:
    names, stamps = first_states(bag, selection)
    timebase, doubt = timebase_of(stamps, flight)
    damage += doubt
    first_tick, rest = divmod(stamps[0], timebase.period_ns)
    counted = "period" in flight or (not rest and 0 <= first_tick <= LONGEST_JUMP)
    return Rows(names, timebase, 0 if counted else stamps[0])


def _joint_names(topic: topics.Topic, batch: Batch) -> Iterator[tuple[str, ...]]:
    for i in range(len(batch)):
        with suppress(MessageError):
            message = decode(batch.message(i), topic.type)
            yield tuple(message.name if topic is topics.JOINT_STATES else message.joint_names)


def timebase_of(
    first_stamps: Sequence[int], flight: Mapping[str, Any]
) -> tuple[Timebase, list[str]]:
    """Return the timebase of a flight, and a warning if the stamps (ns) contradict its description.

    The described period is taken unless they do.
    """
    described = flight.get("period")
    steps = np.diff(np.array(first_stamps, np.int64))
    distinct, counts = np.unique(steps[steps > 0], return_counts=True)
    likely_ns = int(distinct[np.argmax(counts)]) if len(distinct) else None
    if described is not None:
        described_ns = round(described * 1e9)
        if likely_ns is None or likely_ns == described_ns:
            return Timebase(described_ns), []
        if likely_ns % described_ns == 0 and topics_with_allowed_gaps(flight):
            return Timebase(described_ns), []  # states were kept back
    if likely_ns is None:
        return Timebase(round(DEFAULT_PERIOD * 1e9)), []
    said = f"described with a period of {described} s, flown with {likely_ns / 1e9} s"
    return Timebase(likely_ns), [] if described is None else [said]


def missing(topic: topics.Topic, bag: Bag, selection: Selection) -> InputError:
    """Return the error for a bag without messages of a needed topic."""
    selection.topics()  # a topic to remap that is not there comes first
    if topic.full_name in selection.wrong:
        return InputError(f"{topic.full_name} is {selection.wrong[topic.full_name]}")
    context = [*_not_finished(bag), *bag.damage, selection.listing_instead_of(topic)]
    return InputError(f"no messages on {topic.full_name} ({'; '.join(context)})")


def _not_finished(bag: Bag) -> list[str]:
    return [] if bag.finished else ["the bag was not finished"]


def _count_lost(
    bag: Bag,
    selection: Selection,
    rows: Rows,
    unread: Mapping[str, int],
    accounts: Mapping[str, Account],
) -> None:
    """Set `FlightLog.lost` and `FlightLog.unanswered`: what never came, and what cannot be read."""
    log, in_bag = rows.log, selection.topics()
    accounting = {
        topic.full_name: rows.accounting.get(topic.full_name, MessageAccounting(topic))
        for topic in topics.ALL
        if topic.full_name in rows.accounting or (bag.finished and topic in in_bag)
    }
    log.lost = lost_messages(accounting, topics_with_allowed_gaps(log.flight), bag.finished)
    for name in log.lost if bag.finished else ():
        account, gone = accounts.get(name), unread.get(name, 0)
        if account and rows.counts[name] + gone == account.received + account.invalid_stamps:
            log.lost[name] = account.missing + gone  # the bag is the one that was counted
        else:
            log.lost[name] = max(log.lost[name], gone)
    if topics.COMMAND.full_name in accounting:
        log.unanswered = unanswered_ticks(accounting, bag.finished)
