"""Base classes of control laws: gains, memory, and one equation."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from space_robot_msgs_py.compiled.records import Field, Record, RecordOwner
from space_robot_msgs_py.samples import LawInForce

from .signals import Array, Signals, per_axis

NO_ESTIMATE, CONSTANT_INERTIA, NOMINAL_INERTIA = range(3)
"""Inertia of a law's time-delay estimate, see `ControlLaw.estimate`."""


class LawGains(Record):
    """Base class of a law's gains, each `per_axis`; users write ``lambda`` for ``lambda_``."""


class LawMemory(Record):
    """Last outputs of a law; base class of its internal states."""

    s: Array = per_axis("sliding surface", "1/s")
    """Zero for a law without sliding surface."""
    u: Array = per_axis("pseudo-acceleration", "rad/s2 (eps: 1/s2)")
    force: Array = per_axis("generalised force F_S", "N m")


_BLOCKS = ("gains_block", "memory_block")
"""Attributes of a law that hold its memory."""


class ControlLaw(RecordOwner, ABC):
    """Base class of a control law on m = n+3 axes with a fixed period.

    A new law is a subclass with a ``name``, its gains, and `force` (or, as `CompiledLaw`, a
    kernel). A law with a gain ``h_bar`` receives the time-delay estimate; one with ``uses_model``
    the nominal model (never the payload, friction or disturbance).

    The inertia of the estimate is constant, ``h_bar``, or with the gain ``h_bar: nominal`` the
    inertia H_S of the nominal model: then ``h_bar`` is zero in the law's equation, and the
    controller adds ``H_S u`` to the force in place of ``h_bar u``.
    """

    name: ClassVar[str]
    gains_type: ClassVar[type[LawGains]]
    memory_type: ClassVar[type[LawMemory]] = LawMemory
    uses_model: ClassVar[bool] = False
    estimates_with_model: ClassVar[bool] = False
    """True for a law without ``h_bar`` whose N_hat is always that of the nominal inertia."""
    _views = ("gains", "memory", "h_bar")

    def __init__(self, gains: Mapping[str, Array], period: float, axes: int | None = None) -> None:
        """Set the gains; the memory is zero.

        Args:
            gains: an (m,) array for each of ``gains_type``.
            period: of the controller, s.
            axes: m; needed only for a law without gains.
        """
        n = (axes or len(next(iter(gains.values())))) - 3
        self.period = period
        self.gains_block = self.gains_type.block(n)
        self.memory_block = self.memory_type.block(n)
        self._look_into_blocks()
        self.gain_values = gains
        self.reset()

    def _look_into_blocks(self) -> None:
        self.gains: Any = self.gains_type.view(self.gains_block)
        """The gains as attributes."""
        self.memory: Any = self.memory_type.view(self.memory_block)
        """s and u of the last tick, and the law's internal states, as attributes."""
        self.h_bar: Array = getattr(self.gains, "h_bar", np.zeros(0))
        """(m,) h_bar of the time-delay estimate, kg m2; zero for the nominal inertia, empty without
        an estimate."""

    def save(self) -> dict[str, Any]:
        """Copy gains, memory and all other attributes, for `restore`."""
        return copy.deepcopy(self.__getstate__())

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a saved state."""
        for name, value in copy.deepcopy(dict(saved)).items():
            if name in _BLOCKS:
                getattr(self, name)[:] = value
            else:
                setattr(self, name, value)

    @classmethod
    def gain_descriptions(cls) -> dict[str, str]:
        """Return meaning and unit of each gain by its name for the user."""
        fields = cls.gains_type.fields().items()
        return {name.rstrip("_"): f.description for name, f in fields if isinstance(f, Field)}

    @property
    def gain_values(self) -> dict[str, Array]:
        """(m,) array of each gain by its name for the user."""
        return {name.rstrip("_"): self.gains_block[name][0] for name in self.gains_type.fields()}

    @gain_values.setter
    def gain_values(self, values: Mapping[str, Array]) -> None:
        for name, gain in self.gain_values.items():
            gain[:] = values[name]

    def in_force(self, tick: int, is_first: bool = False) -> LawInForce:
        """Return the law with its present gains as recorded: in force from ``tick`` on."""
        gains = {name: tuple(values.tolist()) for name, values in self.gain_values.items()}
        return LawInForce(tick, self.name, gains, is_first)

    @property
    def estimate(self) -> int:
        """Inertia of the time-delay estimate.

        `NO_ESTIMATE`, `CONSTANT_INERTIA` (``h_bar``) or `NOMINAL_INERTIA` (H_S).
        """
        if self.h_bar.size:
            return CONSTANT_INERTIA if self.h_bar.any() else NOMINAL_INERTIA
        return NOMINAL_INERTIA if self.estimates_with_model else NO_ESTIMATE

    @property
    def needs_model(self) -> bool:
        """True if the law, or its time-delay estimate, uses the nominal model."""
        return self.uses_model or self.estimate == NOMINAL_INERTIA

    @property
    def adds_inertia(self) -> bool:
        """True if ``H_S u`` is added to the law's force, see `checked.force_of`."""
        return self.estimate == NOMINAL_INERTIA and self.h_bar.size > 0

    def reset(self) -> None:
        """Clear the memory (integrals, last errors); called when the law is activated."""
        self.memory_block[:] = np.zeros_like(self.memory_block)

    @abstractmethod
    def force(self, signals: Signals) -> Array:
        """Return the generalised force F_S (m,), N m; valid until the next call."""
