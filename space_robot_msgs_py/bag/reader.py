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
from .accounts import Account, noted_accounts, paused
from .batch import Batch
from .contents import Bag
from .description import read_description
from .findings import half_truth, missing_ticks, unread_messages
from .flight_log import REFERENCE, FlightLog, MeasuredStates, finite_rows
from .folder import open_bag
from .message_accounting import (
    LONGEST_JUMP,
    MessageAccounting,
    lost_messages,
    topics_with_allowed_gaps,
    unanswered_ticks,
)
from .robots import REQUIRED
from .rows import Rows, stamps_of
from .selection import Selection

DEFAULT_PERIOD = 0.0005
"""Period of a bag without a description, s."""
_STAMPS_LOOKED_AT = 200


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
    flight, damage = _description(bag)
    rows = _empty_rows(bag, selection, flight, damage)
    for topic, batch in selection.batches():
        rows.take(topic, batch)
    for topic in REQUIRED:
        if not rows.counts[topic.full_name]:
            raise missing(topic, bag, selection)
    rows.split_truth()
    log, excused = rows.log, topics_with_allowed_gaps(flight)
    log.flight, log.namespace = flight, selection.namespace
    gone = _gone(selection, rows)
    accounts = noted_accounts(bag.custom_data())
    _count_lost(bag, selection, rows, gone, accounts)
    if excused and not (bag.incomplete or any(log.lost[topic.full_name] for topic in REQUIRED)):
        fill_gaps(log)
    whole = log.whole
    ticks = len(whole) - int(np.argmax(whole[::-1])) if whole.any() else 0
    damage += [*bag.damage, *unread_messages(selection.recorded() or {}, gone)]
    damage += [f"{name} is left out: {wrong}" for name, wrong in selection.wrong.items()]
    damage += rows.anomalies(bool(excused)) + paused(accounts) + half_truth(rows.counts)
    if not ticks:
        context = "; ".join(_not_finished(bag) + damage)
        raise InputError(f"not one tick with its state and reference ({context})")
    damage += missing_ticks(whole[:ticks], log.timebase)
    log.damage = tuple(printable(text) for text in damage)
    if not bag.finished:
        last_s = log.timebase.stamp_ns(ticks - 1) / 1e9
        log.unfinished = f"the bag was not finished: read up to t = {last_s:.4f} s"
    return rows.finish(ticks)


def _description(bag: Bag) -> tuple[dict[str, Any], list[str]]:
    """Read the description of the flight, and report its defects."""
    try:
        return read_description(bag.custom_data()), []
    except InputError as error:
        return {}, [str(error)]


def first_states(bag: Bag, selection: Selection) -> tuple[RobotNames, list[int]]:
    """Return the names of the joints, and the first stamps in ns.

    Raises:
        InputError: there is none, or none that can be read.
    """
    names: tuple[str, ...] = ()
    referenced: list[tuple[str, ...]] = []
    stamps: list[int] = []
    for topic, batch in selection.batches():
        if topic is topics.JOINT_STATES:
            names = names or next(_joint_names(topic, batch), ())
            stamps += stamps_of(batch).tolist()
        elif topic is topics.REFERENCE_JOINTS and not _moved(names, referenced):
            referenced += dict.fromkeys(_joint_names(topic, batch))
        if len(stamps) >= _STAMPS_LOOKED_AT and _moved(names, referenced):
            break
    if not names:
        raise missing(topics.JOINT_STATES, bag, selection)
    moved = _moved(names, referenced)
    passive = tuple(name for name in names if name not in moved) if moved else ()
    if len(passive) > MOST_PASSIVE:
        passive = ()
    return RobotNames(tuple(name for name in names if name not in passive), passive=passive), stamps


def _moved(names: tuple[str, ...], referenced: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the joints of the first reference that names no others; the rest have no motor."""
    return next((moved for moved in referenced if moved and set(moved) <= set(names)), ())


def _empty_rows(bag: Bag, selection: Selection, flight: dict[str, Any], damage: list[str]) -> Rows:
    """Rows for the joints and the period of the bag's first states."""
    names, stamps = first_states(bag, selection)
    timebase, doubt = timebase_of(stamps, flight)
    damage += doubt
    first_tick, rest = divmod(stamps[0], timebase.period_ns)
    counted = "period" in flight or (not rest and 0 <= first_tick <= LONGEST_JUMP)
    return Rows(names, timebase, 0 if counted else stamps[0])


def _joint_names(topic: topics.Topic, batch: Batch) -> Iterator[tuple[str, ...]]:
    """The joints in each message of a batch that can be read."""
    for i in range(len(batch)):
        with suppress(MessageError):
            message = decode(batch.message(i), topic.type)
            yield tuple(message.name if topic is topics.JOINT_STATES else message.joint_names)


def timebase_of(
    first_stamps: Sequence[int], flight: Mapping[str, Any]
) -> tuple[Timebase, list[str]]:
    """The period that was flown with: as described, if the stamps (ns) are not against it.

    With it what is wrong with the description's.
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


def _gone(selection: Selection, rows: Rows) -> dict[str, int]:
    """Recorded messages that could not be read, by topic."""
    recorded = selection.recorded() or {}
    counts = ((name, count - rows.counts[name]) for name, count in recorded.items())
    return {name: count for name, count in counts if count > 0}


def _count_lost(
    bag: Bag,
    selection: Selection,
    rows: Rows,
    gone: Mapping[str, int],
    accounts: Mapping[str, Account],
) -> None:
    """`FlightLog.lost` and `FlightLog.unanswered`: what never came and what is gone since."""
    log = rows.log
    there = selection.topics()
    accounting = {
        topic.full_name: rows.accounting.get(topic.full_name, MessageAccounting(topic))
        for topic in topics.ALL
        if topic.full_name in rows.accounting or (bag.finished and topic in there)
    }
    log.lost = lost_messages(accounting, topics_with_allowed_gaps(log.flight), bag.finished)
    for name in log.lost if bag.finished else ():
        account, unread = accounts.get(name), gone.get(name, 0)
        if account and rows.counts[name] + unread == account.received + account.invalid_stamps:
            log.lost[name] = account.missing + unread  # the bag is the one that was counted
        else:
            log.lost[name] = max(log.lost[name], unread)
    if topics.COMMAND.full_name in accounting:
        log.unanswered = unanswered_ticks(accounting, bag.finished)
