"""Components of the plant: records filled from data sheets, and the faults that change them.

A component is one class in one file. Each field of its record says where its first numbers are
from, ``FAULTS`` what can become of them in flight; its kernels stand below it.
"""

from __future__ import annotations

import math
from functools import cache
from operator import attrgetter
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.topics import BASE_AXES

from .faults.grammar import About, Kind
from .faults.schedule import Schedule, ScheduledFault

Array = NDArray[np.float64]


class Installation(NamedTuple):
    """Numbers of the plant on which a component's depend, beside its data sheet."""

    n: int
    """Joints with motors."""
    period: float = 1.0
    """Length of a tick, s."""
    truth: Any = None
    """The `State` at tick 0, before which the robot was at rest."""
    robot: Any = None
    """The plant's `Robot`, with its payload."""
    is_prismatic: Any = ()
    """(n,) which joints slide; empty: none."""
    motors: Any = ()
    """(n,) number from 1 of the motor that a joint's encoder measures, 0: it measures the link;
    empty: all are 0."""
    seed: int = 0
    """Of random numbers, below 2**32."""


class Component(Record):
    """Base class of the components' records."""

    FAULTS: ClassVar[tuple[Kind, ...]] = ()
    """Kinds of faults that change the record."""

    @classmethod
    def build(cls, sheet: Any, at: Installation) -> Self:
        """Return a record with the numbers of a data sheet."""
        component = cls.allocate(at.n)
        cls._fill(component, sheet, at)
        return component

    @classmethod
    def _fill(cls, record: Any, sheet: Any, at: Installation) -> None:
        if not cls.is_fitted(sheet):
            return
        for name, field in cls.fields().items():
            if isinstance(field, type):  # a part has a section of its own, or shares the sheet
                section = getattr(sheet, name, None)
                part = section if isinstance(section, StrictModel) else sheet
                if issubclass(field, Component):
                    field._fill(record[name], part, at)
                continue
            if field.source is None:  # state and scratch begin at zero
                continue
            if isinstance(field.source, str):
                value = attrgetter(field.source)(sheet)
            else:
                value = field.source(sheet, at)
            if np.ndim(value):  # entries beyond the last one stay zero
                record[name][: len(value)] = value
            else:
                record[name] = value
        cls.refresh(record)

    @staticmethod
    def is_fitted(sheet: Any) -> bool:
        """Return whether a robot with this sheet has the component; its record is zero if not."""
        return bool(getattr(sheet, "count", True))

    @staticmethod
    def refresh(record: Any) -> None:
        """Update the fields that follow from others, after these have changed."""


@cache
def components(record: Any, path: str = "") -> tuple[tuple[str, type[Component]], ...]:
    """Return the components in a record, with their paths in it, as ``actuators.drive``."""
    parts: list[tuple[str, type[Component]]] = []
    for name, field in record.fields().items():
        if isinstance(field, type):
            own = [(path + name, field)] if issubclass(field, Component) else []
            parts += [*own, *components(field, f"{path}{name}.")]
    return tuple(parts)


@cache
def kinds_of(record: Any) -> tuple[Kind, ...]:
    """Return the kinds of faults of all components in a record."""
    return tuple(kind for _, component in components(record) for kind in component.FAULTS)


class TemporaryChange:
    """Change of one array of a record while faults act, which are undone afterwards."""

    def __init__(self, field: str, faults: list[ScheduledFault]) -> None:
        self._field, self._faults = field, faults
        self._acting: list[ScheduledFault] = []

    def apply(self, tick: int, record: Any) -> bool:
        """Let each fault that acts at a tick change the sound numbers, in the flight's order.

        Returns:
            Whether the numbers are others than at the last tick.
        """
        acting = [fault for fault in self._faults if fault.acts_at(tick)]
        if acting == self._acting:
            return False
        values = record[self._field]
        if not self._acting:
            self._sound = values.copy()
        # from the sound numbers each time: an inverse of each change would leave rounding errors
        values[:] = self._sound
        for fault in acting:
            places = _places(fault, record)
            values[places] = fault.kind.change(values[places], fault.value)
        self._acting = acting
        return True


def _places(fault: ScheduledFault, record: Any) -> Any:
    kind = fault.kind
    about = kind.argument.about if kind.argument else None
    if about is None and not kind.group:
        return slice(None)
    axes = np.array(fault.axes, np.intp)
    if about is About.JOINT:  # a schedule counts the base's axes first
        axes -= len(BASE_AXES)
    return record[kind.rows][axes].astype(np.intp) if kind.rows else axes


class ComponentFaults:
    """The faults of the components in a record, of one flight."""

    def __init__(self, schedule: Schedule, record: Any) -> None:
        """Prepare those that ``schedule`` has; ``record``: class of the record."""
        self._changes = [
            (path, component, TemporaryChange(field, faults))
            for path, component in components(record)
            if schedule.faults
            for field in dict.fromkeys(kind.field for kind in component.FAULTS)
            if (faults := schedule.of(*(k.name for k in component.FAULTS if k.field == field)))
        ]
        acting = schedule.of(*(kind.name for kind in kinds_of(record)))
        self._limits = sorted({tick for fault in acting for tick in (fault.first, fault.stop)})
        """Ticks at which a fault begins or ends."""

    def apply(self, tick: int, record: Any) -> float:
        """Apply the faults to the components' records from ``tick`` on.

        Returns:
            The next tick at which that changes (inf: it does not): up to there compiled code flies.
        """
        for path, component, change in self._changes:
            part = attrgetter(path)(record)
            if change.apply(tick, part):
                component.refresh(part)
        return next((limit for limit in self._limits if limit > tick), math.inf)
