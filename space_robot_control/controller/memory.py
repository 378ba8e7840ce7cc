"""The memory of a controller, for compiled loops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Record, nested, shaped

from ..allocation.allocation import Allocation
from ..laws import Signals
from ..navigation.navigation import Navigation
from .time_delay_estimation import TimeDelayPair

Array = NDArray[np.float64]


class ControllerMemory(Record):
    """Memory of the controller, without its law."""

    controls_base: float = shaped(lambda n: (), uniform=True)
    """1; 0: nothing turns the base, so its axes have no signals and no force."""
    signals: Signals = nested(Signals)
    """Signals of the last tick."""
    pair: TimeDelayPair = nested(TimeDelayPair)
    jacobian: Array = shaped(lambda n: (3, 3))
    """J0 of q_e."""
    last_jacobian_inverse: Array = shaped(lambda n: (3, 3))
    """J0^-1 of the last tick."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Scratch: rotation from the base to the desired frame."""
    omega_desired: Array = shaped(lambda n: (3,))
    """Desired angular velocity on the base's axes, rad/s; zero if that is not controlled."""
    error: Array = shaped(lambda n: (4,))
    """Scratch: q_e of the last tick, had the reference moved as it does now."""
    turn: Array = shaped(lambda n: (4,))
    """Scratch: the desired frame's turn back to the last tick."""
    turned_jacobian: Array = shaped(lambda n: (3, 3))
    """Scratch: J0 of ``error``."""
    pair_is_as_measured: float = shaped(lambda n: ())
    """1 if the time-delay pair has rates as they were measured, 0 if as navigation has them."""
    rate_as_measured: Array = shaped(lambda n: (n + 3,))
    """Scratch: rhodot without the navigation's low-pass."""
    force_as_measured: Array = shaped(lambda n: (n + 3,))
    """Scratch: F_S without the same."""
    omega: Array = shaped(lambda n: (3,))
    """Scratch."""
    force: Array = shaped(lambda n: (n + 3,))
    """F_S commanded."""
    transfer: Array = shaped(lambda n: (n + 3,))
    """Applied force minus force of the law in force when it took over."""
    transfer_ticks: float = shaped(lambda n: (), uniform=True)
    """Length of a transfer."""
    transfer_left: float = shaped(lambda n: ())
    """Ticks until ``transfer`` has faded; -1: the law takes over at this tick."""
    navigation: Navigation = nested(Navigation)
    allocation: Allocation = nested(Allocation)
