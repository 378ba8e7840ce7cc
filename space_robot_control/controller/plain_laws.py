"""Laws without gains: a user's function, or no law."""

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
    """Law given by a function of the signals and the nominal model; see `law_of`."""

    gains_type: ClassVar[type[LawGains]] = LawGains
    uses_model: ClassVar[bool] = True
    function: ClassVar[Force]

    def force(self, signals: Signals) -> Array:
        """Call the function.

        Raises:
            InputError: the function did not return one number per axis.
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
    """Law that commands zero torque, for torques from outside, as on the bench."""

    name: ClassVar[str] = "none"
    gains_type: ClassVar[type[LawGains]] = LawGains

    def force(self, signals: Signals) -> Array:
        """Return zeros (m,)."""
        force: Array = self.memory.force
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
