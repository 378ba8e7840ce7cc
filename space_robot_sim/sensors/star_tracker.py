"""Star tracker: sampled, noisy and delayed measurements of the base's attitude."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import four, multiply
from space_robot_model.elementary.functions import in_steps, sin_cos
from space_robot_model.elementary.matrices import norm
from space_robot_model.elementary.rotations import plain_sin_cos
from space_robot_model.hardware.sensors import MOST_UNDER_WAY, StarTrackerSettings
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import any_lane, where, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import State

from ..component import Component, Installation
from ..faults.grammar import Argument, Kind, add_noise, switch_on
from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]


def _before(sheet: StarTrackerSettings, at: Installation) -> Array:
    """Return the attitude (4,) shown at tick 0: a delay before it, at a rate that was constant."""
    truth, delay = at.truth, sheet.ticks(at.period)[1]
    turn = -delay * at.period * truth.omega_base
    if (angle := norm(turn)) == 0.0:
        return np.asarray(truth.quaternion)
    sine, cosine = plain_sin_cos(0.5 * angle)
    x, y, z = turn * (sine / angle)
    a, b, c, d = truth.quaternion
    return np.array(
        [
            a * cosine - b * x - c * y - d * z,
            a * x + b * cosine + c * z - d * y,
            a * y + c * cosine + d * x - b * z,
            a * z + d * cosine + b * y - c * x,
        ]
    )


class StarTracker(Component):
    """Parameters of a star tracker, and its measurements.

    The noise is a small rotation on base axes, ``n`` (3,) being standard normal numbers and ``b``
    the boresight: ``sigma_across n + (sigma_about - sigma_across) (b . n) b``, so that it has the
    standard deviation ``sigma_about`` about ``b`` and ``sigma_across`` about all axes across it.
    """

    sigma: Array = shaped(lambda n: (2,), source=lambda s, at: [s.noise_across, s.noise_about])
    """rad: across the boresight, about it."""
    boresight: Array = shaped(
        lambda n: (3,), source=lambda s, at: np.array(s.boresight) / norm(s.boresight)
    )
    """Unit vector on base axes."""
    interval: float = shaped(lambda n: (), uniform=True, source=lambda s, at: s.ticks(at.period)[0])
    """Ticks between two measurements; the first is taken at tick 0."""
    delay: float = shaped(lambda n: (), uniform=True, source=lambda s, at: s.ticks(at.period)[1])
    """Ticks from a measurement to its release."""
    step: Array = shaped(lambda n: (1,), source="step")
    """The quaternion's numbers come in steps of half of it, rad (0: none)."""
    blind: Array = shaped(lambda n: (1,))
    """1 while no measurement can be taken."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 3))
    """Standard normal numbers, a row a tick."""
    taken: Array = shaped(lambda n: (MOST_UNDER_WAY,))
    """1 for each measurement in transit that could be taken."""
    under_way: Array = shaped(lambda n: (MOST_UNDER_WAY, 4))
    """Measurements in transit, by number modulo `MOST_UNDER_WAY`."""
    held: Array = shaped(lambda n: (4,), source=_before)
    """The measurement released last."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "noise_attitude",
            Argument("SIGMA", "rad", 0.0, 1e3),
            "noise of standard deviation SIGMA about each axis of the measured attitude",
            "sigma",
            add_noise,
        ),
        Kind(
            "tracker_blind",
            None,
            "no attitude is measured; the last one is held",
            "blind",
            switch_on,
        ),
        Kind(
            "quantise_attitude",
            Argument("STEP", "rad", 1e-12, 1.0),
            "the measured quaternion is quantised in steps of STEP / 2",
            "step",
            np.maximum,
        ),
    )


@kernel
def track_stars(tracker: StarTracker, truth: State, tick: int, measured: State) -> None:
    """Write the attitude released last at ``tick`` into ``measured``.

    Measurement k shows the attitude of tick ``k interval``, is released ``delay`` ticks later and
    held until the next one; while the tracker is blind, none is taken. At tick 0 it shows the
    attitude that ``held`` has before.
    """
    interval, delay = whole(tracker.interval), whole(tracker.delay)
    if tick % interval == 0:
        place = (tick // interval) % MOST_UNDER_WAY
        tracker.taken[place] = 1.0 - tracker.blind[0]
        draws = tracker.draws[tick % BLOCK_TICKS]
        if tick == 0:
            # a tracker that has been on for long holds a measurement from before the flight
            expose(tracker, tracker.held, draws, tracker.under_way[place])
            _release(tracker, place)
        expose(tracker, truth.quaternion, draws, tracker.under_way[place])
    exposed = tick - delay
    if exposed >= 0 and exposed % interval == 0:
        _release(tracker, (exposed // interval) % MOST_UNDER_WAY)
    measured.quaternion[:] = tracker.held


@subroutine
def _release(tracker: StarTracker, place: int) -> None:
    is_taken = tracker.taken[place] == 1.0
    for i in range(4):
        tracker.held[i] = where(is_taken, tracker.under_way[place, i], tracker.held[i])


@kernel
def expose(tracker: StarTracker, quaternion: Array, draws: Array, out: Array) -> None:
    """Write the measurement of ``quaternion`` (4,) with ``draws`` (3,) into ``out`` (4,)."""
    across, about, boresight = tracker.sigma[0], tracker.sigma[1], tracker.boresight
    along = draws[0] * boresight[0] + draws[1] * boresight[1] + draws[2] * boresight[2]
    x = across * draws[0] + (about - across) * along * boresight[0]
    y = across * draws[1] + (about - across) * along * boresight[1]
    z = across * draws[2] + (about - across) * along * boresight[2]
    angle = np.sqrt(x * x + y * y + z * z)
    is_turned = angle > 0.0  # by the quaternion of the rotation x, y, z
    sine, cosine = sin_cos(0.5 * angle)
    sine /= where(is_turned, angle, 1.0)
    # the noise turns about the base's axes: q (x) noise
    turned = multiply(four(quaternion), (cosine, sine * x, sine * y, sine * z))
    out[0], out[1], out[2], out[3] = where(is_turned, turned, four(quaternion))
    step = 0.5 * tracker.step[0]
    if any_lane(step > 0.0):
        # rounded numbers are no unit quaternion any more
        for i in range(4):
            out[i] = in_steps(out[i], step)
        length = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3])
        for i in range(4):
            out[i] /= where(step > 0.0, length, 1.0)
