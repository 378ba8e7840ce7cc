"""Low-pass filter of the base's rate and of the paired torque.

Two first-order stages in a row: one alone would leave the noise of a differenced rate as it is
in the highest frequencies. The time-delay estimate differences the rate and takes the force that
made it; lagging alike, the two stay a pair (see `..time_delay_estimation`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import exp
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.compiled.records import Record, shaped

Array = NDArray[np.float64]


def low_pass_weight(corner_hz: float, period: float) -> float:
    """Return the weight of a new sample in a first-order low-pass; 0 without one."""
    return 1.0 - exp(-2.0 * math.pi * corner_hz * period)


class LowPass(Record):
    """Both stages of rate and torque of three axes."""

    weight: float = shaped(lambda n: ())
    """Of a new sample in each stage, see `low_pass_weight`; 0: no low-pass."""
    rate_stage: Array = shaped(lambda n: (3,))
    rate: Array = shaped(lambda n: (3,))
    """rad/s."""
    torque_stage: Array = shaped(lambda n: (3,))
    torque: Array = shaped(lambda n: (3,))
    """N m."""


@kernel
def begin_low_pass(low_pass: LowPass, rate: Array, torque: Array) -> None:
    """Begin in steady state at these values."""
    for i in range(3):
        low_pass.rate_stage[i] = rate[i]
        low_pass.rate[i] = rate[i]
        low_pass.torque_stage[i] = torque[i]
        low_pass.torque[i] = torque[i]


@kernel
def pass_low(low_pass: LowPass, rate: Array, torque: Array) -> None:
    """Filter rate and torque (at least 3,) of one tick."""
    weight = where(low_pass.weight > 0.0, low_pass.weight, 1.0)
    for i in range(3):
        low_pass.rate_stage[i] = _stepped(low_pass.rate_stage[i], rate[i], weight)
        low_pass.rate[i] = _stepped(low_pass.rate[i], low_pass.rate_stage[i], weight)
        low_pass.torque_stage[i] = _stepped(low_pass.torque_stage[i], torque[i], weight)
        low_pass.torque[i] = _stepped(low_pass.torque[i], low_pass.torque_stage[i], weight)


@subroutine
def _stepped(last: float, new: float, weight: float) -> float:
    """Return a stage's next value; with a weight of 1 the new sample itself."""
    return where(weight == 1.0, new, last + weight * (new - last))
