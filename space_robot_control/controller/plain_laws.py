"""Laws without gains: one that is a function from anywhere, and none at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.errors import InputError

from ..laws import ControlLaw, LawGains, Signals

Array = NDArray[np.float64]
Force = Callable[[Signals], ArrayLike]
"""The generalised force F_S (m,), N m, of a tick's signals."""


class FunctionLaw(ControlLaw):
    """A law that is a function of the signals and the nominal model; see `law_of`."""

    gains_type: ClassVar[type[LawGains]] = LawGains
    uses_model: ClassVar[bool] = True
    function: ClassVar[Force]

    def force(self, signals: Signals) -> Array:
        """Call the function.

        Raises:
            InputError: it returned something else than one number an axis.
        """
        force: Array = self.memory.force
        value = np.asarray(type(self).function(signals))
        if value.shape != force.shape:
            raise InputError(
                f"controller {self.name}: {force.size} numbers were expected, "
                f"got an array of shape {value.shape}"
            )
        force[:] = value
        return force


class NoLaw(ControlLaw):
    """Commands no torque: every one comes from elsewhere, as on the bench."""

    name: ClassVar[str] = "none"
    gains_type: ClassVar[type[LawGains]] = LawGains

    def force(self, signals: Signals) -> Array:
        """Zero (m,)."""
        force: Array = self.memory.force
        return force


def law_of(function: Force) -> type[FunctionLaw]:
    """Make a law of a function, which gives it its name."""
    name = getattr(function, "__name__", type(function).__name__)
    content: dict[str, Any] = {
        "name": name,
        "function": staticmethod(function),
        "__doc__": function.__doc__,
        "__module__": getattr(function, "__module__", __name__),
    }
    return type(name, (FunctionLaw,), content)
