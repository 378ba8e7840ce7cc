"""Disturbance torques on base and joints, (61)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_model.elementary.functions import sin_cos
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.config.validation import StrictModel

from ..component import Component
from .disturbance_table import check_table_text

Array = NDArray[np.float64]

Amplitude = Annotated[float, Field(ge=0.0, le=1e6)]
Frequencies = Annotated[list[float], Field(min_length=2, max_length=2)]


class DisturbanceSettings(StrictModel):
    """Disturbance torques: ``scale * amplitude * (sin(2 pi f1 t) + sin(2 pi f2 t))``, (61).

    ``table`` adds a disturbance of the user's own, see `DisturbanceTable`.
    """

    scale: Amplitude = Field(0.0, description="factor on the sines, k of (61)-(63)")
    base_amplitude: Amplitude = Field(0.010, description="amplitude on base x, y, z, N m")
    base_frequencies: Frequencies = Field(
        [0.5, 0.75], description="frequencies of the two sines of this disturbance, Hz (0: none)"
    )
    inner_amplitude: Amplitude = Field(0.005, description="amplitude on joints 1 to 3, N m")
    inner_frequencies: Frequencies = Field(
        [0.25, 0.5], description="frequencies of the two sines of this disturbance, Hz (0: none)"
    )
    outer_amplitude: Amplitude = Field(0.002, description="amplitude on joints 4 and up, N m")
    outer_frequencies: Frequencies = Field(
        [0.25, 0.0], description="frequencies of the two sines of this disturbance, Hz (0: none)"
    )
    table: Annotated[str, AfterValidator(check_table_text)] = Field(
        "",
        description="a disturbance of your own: a CSV or Parquet file with columns of time, see "
        "docs/manual, or its numbers as JSON (empty: none)",
    )
    table_scale: Annotated[float, Field(ge=-1e6, le=1e6)] = Field(
        1.0, description="factor on all numbers of the table"
    )


class Disturbance(Component):
    """Sinusoidal disturbances in three groups: base, joints 1 to 3, joints 4 and up."""

    amplitude: Array = shaped(
        lambda n: (3,),
        origin=lambda s, at: (
            s.scale * np.array([s.base_amplitude, s.inner_amplitude, s.outer_amplitude])
        ),
    )
    """N m; on the base about inertial axes."""
    angular_frequency: Array = shaped(
        lambda n: (3, 2),
        origin=lambda s, at: (
            2.0 * np.pi * np.array([s.base_frequencies, s.inner_frequencies, s.outer_frequencies])
        ),
    )
    """rad/s, of the two sines of each group."""


@kernel
def disturbance_torque(disturbance: Disturbance, time: float, out: Array) -> None:
    """Write into ``out`` (n+3,) ``f_d`` of (61) at ``time`` (s), N m.

    On the base about inertial axes, then on the joints.
    """
    frequency = disturbance.angular_frequency
    for group in range(3):
        first, last = 3 * group, out.size if group == 2 else min(3 * group + 3, out.size)
        amplitude = disturbance.amplitude[group]
        torque = amplitude
        if any_lane(amplitude != 0.0):
            wave = sin_cos(frequency[group, 0] * time)[0] + sin_cos(frequency[group, 1] * time)[0]
            torque = where(amplitude != 0.0, amplitude * wave, 0.0)
        for i in range(first, last):
            out[i] = torque
