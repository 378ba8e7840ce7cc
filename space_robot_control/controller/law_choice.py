"""The law in force from tick to tick, planned swaps, and laws without gains."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.bag.law_history import LawChange, same
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import LawInForce
from space_robot_msgs_py.simulated_time import check_time, tick_from

from ..laws import ControlLaw, LawGains, Signals
from .tick import swaps_due

Array = NDArray[np.float64]
Force = Callable[[Signals], ArrayLike]
"""The generalised force F_S (m,), N m, of a tick's signals."""


class LawChoice:
    """The law in force from tick to tick, chosen by the user or by planned swaps."""

    def __init__(self, chosen: ControlLaw, swaps: Iterable[tuple[int, ControlLaw]] = ()) -> None:
        """Begin with a law; ``swaps`` are increasing ticks with the laws in force from each."""
        self._chosen = chosen
        planned = list(swaps)
        self._ticks = np.array([tick for tick, _ in planned], dtype=np.float64)
        self._laws = [law for _, law in planned]
        self._made = 0
        self._last: LawInForce | None = None
        self._may_differ = True
        """True if law or gains may differ from the last tick answered."""
        self.was_swapped = False
        """True after a swap; to be cleared by the caller that reports it."""

    @property
    def chosen(self) -> ControlLaw:
        """The law that answers next."""
        return self._chosen

    def choose(self, law: ControlLaw) -> None:
        """Choose ``law`` from now on; its gains may have changed."""
        self._chosen, self._may_differ = law, True

    def change_at(self, tick: int) -> LawChange | None:
        """Apply the swaps that are due; return the law in force if it, or its gains, changed.

        Called once for each tick that is answered.
        """
        due = swaps_due(self._ticks, self._made, tick) if self._made < len(self._laws) else 0
        if due > self._made:
            self._made = due
            self.choose(self._laws[due - 1])
            self.was_swapped = True
        if not self._may_differ:
            return None
        self._may_differ = False
        before, now = self._last, self._chosen.in_force(tick, is_first=self._last is None)
        if before and same(before, now):
            return None
        self._last = now
        return LawChange(before, now)


class Swap(NamedTuple):
    """Swap to the law ``name`` at ``tick``."""

    tick: int
    name: str


def parse_swaps(texts: Iterable[str], period: float) -> list[Swap]:
    """Parse planned swaps ``T:LAW``, T in simulated seconds, and sort them by tick.

    Empty texts are ignored.
    """
    swaps = sorted(_parse(text, period) for text in texts if text.strip())
    for one, other in itertools.pairwise(swaps):
        if one.tick == other.tick:
            raise InputError(f"swaps to {one.name} and to {other.name} fall on tick {one.tick}")
    return swaps


def _parse(text: str, period: float) -> Swap:
    seconds, _, name = text.partition(":")
    try:
        time = float(seconds)
    except ValueError:
        time = math.nan
    where = f"swap {short(text)}"
    if math.isnan(time) or not name.strip():
        raise InputError(f"{where}: T:LAW expected, T in simulated seconds, as in 5:tde_smc")
    try:
        check_time(time)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Swap(int(tick_from(time, period)), name.strip())


class NoLaw(ControlLaw):
    """Law that commands zero torque, for torques from outside, as on the bench."""

    name: ClassVar[str] = "none"
    gains_type: ClassVar[type[LawGains]] = LawGains

    def force(self, signals: Signals) -> Array:
        """Return zeros (m,)."""
        force: Array = self.memory.force
        return force


class FunctionLaw(ControlLaw):
    """Law given by a function of the signals and the nominal model; see `law_of`."""

    gains_type: ClassVar[type[LawGains]] = LawGains
    uses_model: ClassVar[bool] = True
    function: ClassVar[Force]

    def force(self, signals: Signals) -> Array:
        """Call the function."""
        force: Array = self.memory.force
        value = np.asarray(type(self).function(signals))
        if value.shape != force.shape:
            raise InputError(
                f"controller {self.name}: {force.size} numbers were expected, "
                f"got an array of shape {value.shape}"
            )
        force[:] = value
        return force


def law_of(function: Force) -> type[FunctionLaw]:
    """Make a law from a function and its name."""
    name = getattr(function, "__name__", type(function).__name__)
    content: dict[str, Any] = {
        "name": name,
        "function": staticmethod(function),
        "__doc__": function.__doc__,
        "__module__": getattr(function, "__module__", __name__),
    }
    return type(name, (FunctionLaw,), content)
