"""A control law: gains, a memory, and one equation."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.rho_space import RhoSpaceModel
from space_robot_msgs_py.compiled.records import Field, Record, RecordOwner, nested, shaped
from space_robot_msgs_py.samples import LawInForce

Array = NDArray[np.float64]


def per_axis(description: str, unit: str = "") -> Any:
    """Declare a gain, or a part of a law's memory, with one value an axis: (m,)."""
    return shaped(lambda n: (n + 3,), ", ".join(filter(None, (description, unit))))


class Signals(Record):
    """What a law sees at a tick, in the coordinates ``rho = [eps, theta]``, m = n+3 axes."""

    error: Array = per_axis("e = rho_d - rho")
    error_rate: Array = per_axis("edot")
    acceleration_desired: Array = per_axis("rhodd_d")
    n_hat: Array = per_axis("time-delay estimate N_hat of (35), (36)", "N m")
    """Zero for laws without ``h_bar``."""
    nominal: RhoSpaceModel = nested(RhoSpaceModel)
    """``inertia`` (m, m) H_S and ``bias`` (m,) c_S; filled only for laws with ``uses_model``.

    Of a base that nothing turns they are those of `space_robot_model.dynamics.free_floating`, and
    all other signals are zero on its axes.
    """


class LawGains(Record):
    """Base of a law's gains, each `per_axis`; ``lambda_`` in code is ``lambda`` to the user."""


class LawMemory(Record):
    """A law's last outputs; base of what it remembers beside them."""

    s: Array = per_axis("sliding surface", "1/s")
    """Stays zero for a law without one."""
    u: Array = per_axis("pseudo-acceleration", "rad/s2 (eps: 1/s2)")
    force: Array = per_axis("generalised force F_S", "N m")


_BLOCKS = ("gains_block", "memory_block")
"""Attributes of a law that hold its memory."""


class ControlLaw(RecordOwner, ABC):
    """One control law on m = n+3 axes at a fixed period.

    A new law is a subclass with a ``name``, its gains, and `force` (or, as `CompiledLaw`, a
    kernel). A law with a gain ``h_bar`` is given the time-delay estimate for it; one with
    ``uses_model`` the nominal model (never the payload, friction or disturbance).
    """

    name: ClassVar[str]
    gains_type: ClassVar[type[LawGains]]
    memory_type: ClassVar[type[LawMemory]] = LawMemory
    uses_model: ClassVar[bool] = False
    _views = ("gains", "memory", "h_bar")

    def __init__(self, gains: Mapping[str, Array], period: float, axes: int | None = None) -> None:
        """Begin with a memory of zeros.

        Args:
            gains: an (m,) array for each of ``gains_type``.
            period: s.
            axes: m, of a law without gains.
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
        """s and u of the last tick, and what the law remembers, as attributes."""
        self.h_bar: Array = getattr(self.gains, "h_bar", np.zeros(0))
        """(m,) h_bar of the time-delay estimate; empty if the law has none."""

    def save(self) -> dict[str, Any]:
        """Copy gains, memory and all other attributes, for `restore`."""
        return copy.deepcopy(self.__getstate__())

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Be again what was saved."""
        for name, value in copy.deepcopy(dict(saved)).items():
            if name in _BLOCKS:
                getattr(self, name)[:] = value
            else:
                setattr(self, name, value)

    @classmethod
    def gain_descriptions(cls) -> dict[str, str]:
        """Meaning and unit of each gain by the name it has for the user."""
        fields = cls.gains_type.fields().items()
        return {name.rstrip("_"): f.description for name, f in fields if isinstance(f, Field)}

    @property
    def gain_values(self) -> dict[str, Array]:
        """(m,) array of each gain by the name it has for the user."""
        return {name.rstrip("_"): self.gains_block[name][0] for name in self.gains_type.fields()}

    @gain_values.setter
    def gain_values(self, values: Mapping[str, Array]) -> None:
        for name, gain in self.gain_values.items():
            gain[:] = values[name]

    def in_force(self, tick: int, is_first: bool = False) -> LawInForce:
        """The law with its present gains, for the record: it commands from ``tick`` on."""
        gains = {name: tuple(values.tolist()) for name, values in self.gain_values.items()}
        return LawInForce(tick, self.name, gains, is_first)

    @classmethod
    def uses_time_delay_estimate(cls) -> bool:
        """True if the law adds N_hat."""
        return "h_bar" in cls.gains_type.fields()

    def reset(self) -> None:
        """Forget the past (integrals, last errors): called when the law is switched on."""
        self.memory_block[:] = np.zeros_like(self.memory_block)

    @abstractmethod
    def force(self, signals: Signals) -> Array:
        """The generalised force F_S (m,), valid until the next call."""
