"""Drives of the axes: limits, errors between commanded and given torque, and the reported torque.

A torque ``u`` that has passed the limits is given as the following, axis by axis:

    u -> [quantisation -> dead band] -> lag -> [scale, bias] -> given

Quantisation gives whole steps, ``step * floor(u / step + 1/2)``; the dead band gives nothing for
less than its width, and the rest as it is. The lag is of first order, ``tau dy/dt + y = u``. Under
a ``u`` held over a tick T its exact response from ``y_0`` is ``u + (y_0 - u) exp(-t / tau)``; what
is given over the tick is the mean of that, so the angular momentum that it brings is exact:

    mean = u + (y_0 - u) tau / T (1 - exp(-T / tau)),    y_1 = u + (y_0 - u) exp(-T / tau)

A scale error multiplies and a bias is added last, as errors of a drive's amplifier do. The flight
software receives a report on the torque:

    reported = scale * source + bias

The source is the command within its limits, as a drive's computer has it, or the torque that is
given, as a sensor on the shaft has it. A time-delay estimate is made of this echo, so its scale is
critical: under ``reported = b * command``, ``given = a * command`` the error of the estimate obeys
``b E - a H_S^-1 H_bar`` in place of ``E - H_S^-1 H_bar``, which grows where b exceeds 1 by more
than the smallest eigenvalue of ``a H_S^-1 H_bar``. What the drives give (a) matters less.
"""

from __future__ import annotations

from decimal import Decimal
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_model.hardware.sheets import per_axis
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, uniform, where
from space_robot_msgs_py.compiled.records import Source, assign, shaped

from ..component import Component
from ..faults.grammar import About, Argument, Kind

Array = NDArray[np.float64]

LIMIT = Argument("TORQUE", "N m", 0.0, 1e6)
TORQUE = Argument("TORQUE", "N m", -1e6, 1e6, About.AXIS)


def _axes(name: str) -> Source:
    return lambda sheet, at: per_axis(sheet, name, at.n)


class TorqueLimit(Component):
    """The torque limits of one robot's actuators."""

    limit: Array = shaped(
        lambda n: (n + 3,),
        source=lambda s, at: np.array(
            3 * [s.base_torque_limit or np.inf] + at.n * [s.joint_torque_limit or np.inf]
        ),
    )
    """Largest torque of each axis, N m: base x, y, z (base frame), then joints."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "saturate_base",
            LIMIT,
            "torque limit of an ideal base",
            "limit",
            np.minimum,
            group="base",
        ),
        Kind(
            "saturate_joints",
            LIMIT,
            "torque limit of the joints' motors",
            "limit",
            np.minimum,
            group="joints",
        ),
    )


@kernel
def limit_torque(limits: TorqueLimit, torque: Array) -> float:
    """Limit ``torque`` (n+3,) N m in place.

    Returns:
        1 if it exceeded one, else 0.
    """
    limit, saturated = limits.limit, 0.0
    for i in range(torque.size):
        wanted = torque[i]
        torque[i] = min(max(wanted, -limit[i]), limit[i])
        saturated = where(torque[i] != wanted, 1.0, saturated)
    return saturated


def lag_decays(lag: float, period: float) -> tuple[float, float]:
    """Return ``exp(-T / tau)`` and its mean over the tick, for a lag ``tau`` and a period, s."""
    if lag == 0.0:
        return 0.0, 0.0
    # decimal arithmetic is the same on every machine, the C library's exp is not
    ratio = Decimal(period) / Decimal(lag)
    decay = (-ratio).exp()
    return float(decay), float((1 - decay) / ratio)


def _decays(which: int, sheet: Any, at: Any) -> list[float]:
    return [lag_decays(lag, at.period)[which] for lag in per_axis(sheet, "drive_lag", at.n)]


class Drive(Component):
    """The drives of one robot, an axis each: base x, y, z (base frame), then joints."""

    scale: Array = shaped(lambda n: (n + 3,), source=_axes("drive_scale"))
    """Torque given per torque commanded."""
    bias: Array = shaped(lambda n: (n + 3,), source=_axes("drive_bias"))
    """N m."""
    step: Array = shaped(lambda n: (n + 3,), source=_axes("drive_step"))
    """N m; 0: any torque can be given."""
    dead_band: Array = shaped(lambda n: (n + 3,), source=_axes("drive_dead_band"))
    """N m."""
    decay: Array = shaped(lambda n: (n + 3,), source=partial(_decays, 0))
    """``exp(-T / tau)`` of the lag; 0 without one."""
    mean_decay: Array = shaped(lambda n: (n + 3,), source=partial(_decays, 1))
    """``tau / T (1 - exp(-T / tau))``; 0 without a lag."""
    lagging: Array = shaped(lambda n: (n + 3,))
    """The lag's output at the current tick, N m."""
    is_exact: float = shaped(lambda n: ())
    """1 if the drive is exact, so that its kernel is skipped."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "drive_scale",
            Argument("FACTOR", "1", -100.0, 100.0, About.AXIS),
            "the applied torque is FACTOR times the commanded torque",
            "scale",
            np.multiply,
        ),
        Kind(
            "drive_bias", TORQUE, "the applied torque is TORQUE plus the commanded torque", "bias"
        ),
    )

    @staticmethod
    def refresh(record: Any) -> None:
        """Update ``is_exact``."""
        errors = (record.scale - 1.0, record.bias, record.step, record.dead_band, record.mean_decay)
        assign(record, is_exact=not np.any(errors))


@kernel
def drive_torque(drive: Drive, asked: Array, applied: Array) -> None:
    """Write into ``applied`` (n+3,) what the drives make of ``asked`` (n+3,) over a tick, N m."""
    is_exact = drive.is_exact != 0.0
    if all_lanes(is_exact):
        applied[:] = asked
        return
    for i in range(asked.size):
        mean_decay = drive.mean_decay[i]
        u = in_steps(asked[i], drive.step[i])
        u = where(abs(u) < drive.dead_band[i], 0.0, u)
        if any_lane(mean_decay > 0.0):
            # the mean over the tick is given, y_1 is where the next tick begins
            behind = drive.lagging[i] - u
            drive.lagging[i] = where(mean_decay > 0.0, u + behind * drive.decay[i], 0.0)
            u = where(mean_decay > 0.0, u + behind * mean_decay, u)
        applied[i] = where(is_exact, asked[i], drive.scale[i] * u + drive.bias[i])


class TorqueEcho(Component):
    """Report of torques, one per axis: base x, y, z (base frame), then joints."""

    is_of_given: float = shaped(
        lambda n: (), uniform=True, source=lambda s, at: s.torque_echo == "given"
    )
    """1 if the torque given is reported, 0 if the command within its limits is."""
    scale: Array = shaped(lambda n: (n + 3,), source=_axes("echo_scale"))
    """Reported torque per torque of the source."""
    bias: Array = shaped(lambda n: (n + 3,), source=_axes("echo_bias"))
    """N m."""
    is_exact: float = shaped(lambda n: ())
    """1 if the source itself is reported, so that the kernel is skipped."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "torque_scale",
            Argument("FACTOR", "1", 1e-3, 1e3, About.AXIS),
            "the applied torque is FACTOR times the reported torque",
            "scale",
            np.divide,
        ),
        Kind(
            "torque_bias",
            TORQUE,
            "the applied torque is TORQUE plus the reported torque",
            "bias",
            np.subtract,
        ),
    )

    @staticmethod
    def refresh(record: Any) -> None:
        """Update ``is_exact``."""
        assign(record, is_exact=not np.any((record.scale - 1.0, record.bias)))


@kernel
def report_torque(echo: TorqueEcho, applied: Array, reported: Array) -> None:
    """Write into ``reported`` (n+3,) the report on ``applied`` (n+3,), N m.

    ``reported`` holds the command within its limits before.
    """
    is_exact, is_of_command = echo.is_exact != 0.0, uniform(echo.is_of_given) == 0.0
    if is_of_command and all_lanes(is_exact):
        return
    for i in range(applied.size):
        source = reported[i] if is_of_command else applied[i]
        reported[i] = where(is_exact, source, echo.scale[i] * source + echo.bias[i])
