"""What every control law is: gains, a memory, and one equation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import LawInForce

Array = NDArray[np.float64]


@dataclass(slots=True)
class Signals:
    """What a law sees at a tick, in the coordinates ``rho = [eps, theta]``, m = n+3 axes."""

    error: Array
    """(m,) ``e = rho_d - rho``."""
    error_rate: Array
    """(m,) ``edot``."""
    acceleration_desired: Array
    """(m,) ``rhodd_d``."""
    n_hat: Array
    """(m,) time-delay estimate N_hat of (35), (36); zero for laws without ``h_bar``."""
    inertia: Array
    """(m, m) nominal ``H_S``; filled only for laws with ``uses_model``."""
    bias: Array
    """(m,) nominal ``c_S``; filled only for laws with ``uses_model``."""


class ControlLaw(ABC):
    """One control law on m = n+3 axes at a fixed period.

    A new law is a subclass with a ``name``, its gains, and `force` (or, as `CompiledLaw`, a
    kernel). A law with a gain ``h_bar`` is given the time-delay estimate for it; one with
    ``uses_model`` the nominal model (never the payload, friction or disturbance).
    """

    name: ClassVar[str]
    gain_descriptions: ClassVar[dict[str, str]]
    """What each gain is, by name; one value an axis."""
    uses_model: ClassVar[bool] = False

    def __init__(self, gains: Mapping[str, Array], period: float) -> None:
        """``gains``: an (m,) array for each of ``gain_descriptions``; ``period`` in s."""
        names = list(self.gain_descriptions)
        axes = len(gains[names[0]])
        self.period = period
        self.gain_matrix = np.zeros((len(names), axes))
        """The gains, a row each in the order of ``gain_descriptions``."""
        has_estimate = self.uses_time_delay_estimate()
        self.h_bar = self.gain_matrix[names.index("h_bar")] if has_estimate else np.zeros(0)
        """(m,) h_bar of the time-delay estimate; empty if the law has none."""
        self.gains = gains
        self.sliding_surface = np.zeros(axes)
        """s of the last tick; stays zero for a law without one."""
        self.pseudo_acceleration = np.zeros(axes)
        """u of the last tick, rad/s2 (eps: 1/s2)."""
        self.reset()

    @property
    def gains(self) -> Mapping[str, Array]:
        """(m,) array of each gain by name."""
        return dict(zip(self.gain_descriptions, self.gain_matrix, strict=True))

    @gains.setter
    def gains(self, gains: Mapping[str, Array]) -> None:
        for row, name in zip(self.gain_matrix, self.gain_descriptions, strict=True):
            row[:] = gains[name]

    def in_force(self, tick: int, is_first: bool = False) -> LawInForce:
        """The law with its present gains, for the record: it commands from ``tick`` on."""
        gains = {name: tuple(row.tolist()) for name, row in self.gains.items()}
        return LawInForce(tick, self.name, gains, is_first)

    @classmethod
    def uses_time_delay_estimate(cls) -> bool:
        """Whether the law adds N_hat."""
        return "h_bar" in cls.gain_descriptions

    def reset(self) -> None:  # noqa: B027  (a law without memory has nothing to do)
        """Forget the past (integrals, last errors): called when the law is switched on."""

    @abstractmethod
    def force(self, signals: Signals) -> Array:
        """The generalised force F_S (m,), valid until the next call."""


class CompiledLaw(ControlLaw):
    """A law whose equation is a kernel, so that whole flights run in compiled code."""

    memory_rows: ClassVar[int] = 0
    """Rows of ``memory`` that belong to the law, after s, u and F_S."""

    def __init__(self, gains: Mapping[str, Array], period: float) -> None:
        """See `ControlLaw`."""
        axes = len(next(iter(gains.values())))
        self.memory = np.zeros((3 + self.memory_rows, axes))
        super().__init__(gains, period)
        self.sliding_surface, self.pseudo_acceleration = self.memory[0], self.memory[1]

    @staticmethod
    @abstractmethod
    def kernel(
        e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
        gains: Array, memory: Array, period: float,
    ) -> None:  # fmt: skip
        """One tick of the law: a `kernel` of exactly these arguments.

        Args:
            e: (m,) ``rho_d - rho``, and so on as in `Signals`.
            edot: (m,).
            rhodd_d: (m,).
            n_hat: (m,).
            h_s: (m, m).
            c_s: (m,).
            gains: ``gain_matrix``, a row a gain.
            memory: rows s, u and F_S to be written, then the law's own.
            period: s.
        """

    def reset(self) -> None:
        """Forget everything."""
        self.memory[:] = 0.0

    def force(self, signals: Signals) -> Array:
        """Run the kernel."""
        self.kernel(
            signals.error, signals.error_rate, signals.acceleration_desired, signals.n_hat,
            signals.inertia, signals.bias, self.gain_matrix, self.memory, self.period,
        )  # fmt: skip
        force: Array = self.memory[2]
        return force
