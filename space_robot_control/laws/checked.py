"""Calls of control laws, including user code: a force of the right shape, or one clear error."""

from __future__ import annotations

import signal
import traceback
from pathlib import Path

import numpy as np

from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import SpaceRobotError

from .base import ControlLaw
from .signals import Array, Signals


class LawError(SpaceRobotError):
    """The code of a law raised an error, called ``sys.exit``, or returned an invalid force."""


def force_of(law: ControlLaw, signals: Signals, tick: int) -> Array:
    """Return the generalised force F_S (m,) of a law, with H_S u if ``h_bar`` is nominal.

    Args:
        law: the active law.
        signals: of the tick.
        tick: number of the tick, for error messages.

    Raises:
        LawError: its code raised an error or called ``sys.exit``, or the returned value is not
            an array with one number per axis.
    """
    try:
        force = law.force(signals)
    except SpaceRobotError:
        raise
    except BaseException as error:
        if _is_of_user(error):
            raise
        place = traceback.extract_tb(error.__traceback__)[-1]
        raise LawError(
            f"controller {law.name} failed at tick {tick}: {one_line_of(error)} "
            f"({Path(place.filename).name}, line {place.lineno})"
        ) from error
    wanted = law.memory.force
    if type(force) is not np.ndarray or (force.shape, force.dtype) != (wanted.shape, wanted.dtype):
        got = f"shape {force.shape}, {force.dtype}" if type(force) is np.ndarray else short(force)
        raise LawError(
            f"controller {law.name} failed at tick {tick}: force() must return {wanted.size} "
            f"numbers, an array of {wanted.dtype}, got {got}"
        )
    if law.adds_inertia:
        for column, u in zip(signals.nominal.inertia.T, law.memory.u, strict=True):
            force = force + column * u  # in the order of the compiled loop, so the bits are its
    return force


def _is_of_user(error: BaseException) -> bool:
    """Return True for a KeyboardInterrupt from Ctrl-C: a subclass, or Python's own handler."""
    by_python = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return isinstance(error, KeyboardInterrupt) and (
        type(error) is not KeyboardInterrupt or by_python
    )
