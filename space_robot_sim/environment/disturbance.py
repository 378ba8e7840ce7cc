"""Disturbances: sines on base and joints, (61), and a user's own loads, linear in time.

Over a tick each of a user's loads is ``value + slope (t - begin)``, so that the stages of the
integrator have it at their own times. Every segment begins at a tick. A row between two ticks
changes nothing but the tick around it, over which the loads are linear from its begin to its end:
rows that are whole ticks apart, as 100 Hz at a tick of 0.5 ms, fly exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_model.elementary.functions import sin_cos
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where
from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError

from ..component import Component
from .disturbance_table import TIME, DisturbanceTable, check_table_text

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
        source=lambda s, at: (
            s.scale * np.array([s.base_amplitude, s.inner_amplitude, s.outer_amplitude])
        ),
    )
    """N m; on the base about inertial axes."""
    angular_frequency: Array = shaped(
        lambda n: (3, 2),
        source=lambda s, at: (
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
    # (61): base, joints 1 to 3, joints 4 and up
    for group in range(3):
        first, last = 3 * group, out.size if group == 2 else min(3 * group + 3, out.size)
        amplitude = disturbance.amplitude[group]
        torque = amplitude
        if any_lane(amplitude != 0.0):
            # a sum of two sines; one of 0 Hz is none, as on the outer joints
            wave = sin_cos(frequency[group, 0] * time)[0] + sin_cos(frequency[group, 1] * time)[0]
            torque = where(amplitude != 0.0, amplitude * wave, 0.0)
        for i in range(first, last):
            out[i] = torque


SEGMENTS = 64
"""Segments that the record has room for; `LoadSchedule.apply` writes further ones."""
ROUNDING = 1e-6
"""Ticks that a time may be away from a tick to be at that tick."""


class PrescribedLoads(Record):
    """Force (N) and torque (N m) on the base, base frame, then torques on the actuated joints."""

    is_on: float = shaped(lambda n: (), uniform=True)
    """1 with a disturbance of the user's own, else 0."""
    first: Array = shaped(lambda n: (SEGMENTS + 1,))
    """First tick of each segment, rising; inf for one that is not used."""
    values: Array = shaped(lambda n: (SEGMENTS, 6 + n))
    """Loads at the first tick of each segment, N and N m."""
    slopes: Array = shaped(lambda n: (SEGMENTS, 6 + n))
    """Their rates of change, 1/s."""
    begin: Array = shaped(lambda n: (1,))
    """s; begin of the segment of the present tick."""
    value: Array = shaped(lambda n: (6 + n,))
    """Loads then."""
    slope: Array = shaped(lambda n: (6 + n,))
    """Their rates of change."""
    actuation: Array = shaped(lambda n: (6,))
    """What the actuators give over the tick: force and torque on the base, base frame."""


@kernel
def begin_loads(loads: PrescribedLoads, tick: int, period: float, actuation: Array) -> None:
    """Choose the segment of ``tick``, which lasts ``period`` s.

    ``actuation``: (6,) what the actuators give over the tick, see `PrescribedLoads`.
    """
    for i in range(6):
        loads.actuation[i] = actuation[i]
    for k in range(SEGMENTS):
        is_present = (loads.first[k] <= 1.0 * tick) & (1.0 * tick < loads.first[k + 1])
        if any_lane(is_present):
            loads.begin[0] = where(is_present, loads.first[k] * period, loads.begin[0])
            for i in range(loads.value.size):
                loads.value[i] = where(is_present, loads.values[k, i], loads.value[i])
                loads.slope[i] = where(is_present, loads.slopes[k, i], loads.slope[i])


@kernel
def add_loads(loads: PrescribedLoads, time: float, wrench: Array, disturbance: Array) -> None:
    """Add the loads at ``time`` (s) within the present tick.

    ``wrench`` (6,) becomes the sum of what the actuators give and the loads on the base; loads on
    joints are taken from ``disturbance`` (n+3,), which opposes motion.
    """
    since = time - loads.begin[0]
    for i in range(6):
        wrench[i] = loads.actuation[i] + (loads.value[i] + loads.slope[i] * since)
    for i in range(6, loads.value.size):
        disturbance[i - 3] -= loads.value[i] + loads.slope[i] * since


class LoadSchedule:
    """Segments of a table, in ticks; the rest of a flight depends on its tick alone."""

    def __init__(self, time: Array, loads: Array, period: float) -> None:
        """Place the rows ``loads`` (K, n+6), see `PrescribedLoads`, in ticks of ``period`` s.

        ``time`` (K,) rises, s; without rows there are no loads.
        """
        self._period = period
        self._first, self._values, self._slopes = np.zeros(0), loads, loads
        if not time.size:
            return
        ticks = time / period
        # 0.1 s / 0.5 ms is not 200 to the last bit
        ticks = np.where(np.abs(ticks - np.round(ticks)) <= ROUNDING, np.round(ticks), ticks)
        knots = np.unique([np.floor(ticks), np.ceil(ticks)])
        within = (ticks[0] <= knots) & (knots <= ticks[-1])
        if not within.any():
            raise InputError(
                f"disturbance: no tick of {period:g} s is within {time[0]:g} to {time[-1]:g} s"
            )
        values = np.zeros((len(knots), loads.shape[1]))
        for i, column in enumerate(loads.T):
            values[within, i] = np.interp(knots[within], ticks, column)
        slopes = np.zeros_like(values)
        slopes[:-1] = np.diff(values, axis=0) / (np.diff(knots) * period)[:, np.newaxis]
        values[-1] = 0.0  # from the last tick on
        if knots[0] > 0.0:
            knots = np.concatenate([[0.0], knots])
            nothing = np.zeros((1, loads.shape[1]))
            values, slopes = np.concatenate([nothing, values]), np.concatenate([nothing, slopes])
        self._first, self._values, self._slopes = knots, values, slopes

    @classmethod
    def of(
        cls, settings: DisturbanceSettings, joint_names: Sequence[str], period: float
    ) -> LoadSchedule:
        """Return the schedule of the table in the settings; without a table it has no segments."""
        if not settings.table:
            return cls(np.zeros(0), np.zeros((0, 6 + len(joint_names))), period)
        table = DisturbanceTable.parse(settings.table)
        loads = settings.table_scale * table.loads(joint_names)
        return cls(np.array(table.columns[TIME]), loads, period)

    def over(self, ticks: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return the loads (N, n+6) at the begin and at the end of some ticks, N and N m."""
        if not self._first.size:
            nothing = np.zeros((len(ticks), self._values.shape[1]))
            return nothing, nothing
        segment = np.searchsorted(self._first, ticks, side="right") - 1
        since = self._period * (ticks - self._first[segment])[:, np.newaxis]
        begin = self._values[segment] + self._slopes[segment] * since
        return begin, begin + self._period * self._slopes[segment]

    def apply(self, tick: int, record: Any) -> float:
        """Write the segments from ``tick`` on into a record of `PrescribedLoads`.

        Returns:
            The tick at which further ones are due (inf: none).
        """
        if not self._first.size:
            return math.inf
        start = int(np.searchsorted(self._first, tick, side="right")) - 1
        part = slice(start, start + SEGMENTS)
        count = len(self._first[part])
        first = np.full(SEGMENTS + 1, math.inf)
        following = self._first[start : start + SEGMENTS + 1]
        first[: len(following)] = following
        record["is_on"], record["first"] = 1.0, first
        record["values"][:count] = self._values[part]
        record["slopes"][:count] = self._slopes[part]
        return float(first[SEGMENTS])
