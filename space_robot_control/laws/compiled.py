"""Control laws whose equation is a kernel, so that whole flights run in compiled code."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from space_robot_msgs_py.compiled.kernels import RecordFunction, keep_types
from space_robot_msgs_py.compiled.records import Block, Record, prefix

from .base import ControlLaw, LawMemory
from .signals import Array, Signals, per_axis


class SomeGains(Record):
    """Common layout of the gains of any law: at least one gain."""

    first: Array = per_axis("first gain")


class LawCode(NamedTuple):
    """A law for compiled loops; the type is the same for every law."""

    run: Any
    """The kernel as a function of `Signals`, `SomeGains`, `LawMemory` and the period."""
    gains: Block
    """A block of `SomeGains`."""
    memory: Block
    """A block of `LawMemory`."""
    h_bar: Array
    """(m,) h_bar of the time-delay estimate, kg m2; empty if the law has none."""
    estimate: int
    """See `ControlLaw.estimate`."""
    uses_model: bool
    """See `ControlLaw.needs_model`."""
    adds_inertia: bool
    """See `ControlLaw.adds_inertia`."""


keep_types(LawCode, lambda code: code.run)


class CompiledLaw(ControlLaw):
    """A law with a ``kernel`` (and a ``memory_type``, if it has internal states)."""

    @staticmethod
    @abstractmethod
    def kernel(signals: Signals, gains: Any, memory: Any, period: float) -> None:
        """Compute ``memory.s``, ``memory.u`` and ``memory.force`` of a tick; a `kernel`.

        Args:
            signals: of this tick; read only.
            gains: a record of ``gains_type``.
            memory: a record of ``memory_type``.
            period: of the controller, s.
        """

    @classmethod
    def function(cls, width: int = 1) -> RecordFunction:
        """Return the kernel, compiled for this law's records of numbers of a width.

        Raises:
            InputError: it cannot be compiled for that width.
        """
        own: list[Any] = [cls.gains_type, cls.memory_type]  # classes are hashable
        return _compiled(cls.kernel, *own, width)

    @property
    def code(self) -> LawCode:
        """The law for compiled loops; gains and memory are shared, not copied."""
        n = len(self.memory.s) - 3
        gains = prefix(self.gains_block, SomeGains.dtype(n))
        memory = prefix(self.memory_block, LawMemory.dtype(n))
        needs = self.h_bar, self.estimate, self.needs_model, self.adds_inertia
        return LawCode(self.function(), gains, memory, *needs)

    def force(self, signals: Signals) -> Array:
        """Run the kernel; ``signals`` is a `Signals.view`."""
        n = len(self.memory.s) - 3
        self.function().call(
            signals.address, n, self.gains.address, n, self.memory.address, n, self.period
        )
        force: Array = self.memory.force
        return force


@cache
def _compiled(kernel: Callable[..., None], gains: Any, memory: Any, width: int) -> RecordFunction:
    own, seen = (Signals, gains, memory), (Signals, SomeGains, LawMemory)
    return RecordFunction(kernel, own, seen, width)
