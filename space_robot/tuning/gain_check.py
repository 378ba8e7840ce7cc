"""Check of a law's gains along a mission, without flying it: stability margin and noise gain.

Each law gets two results. Its **margin** against a wrong torque scale, if it estimates by
time delay (see `spectrum`). And its **noise gain** an axis: the torque that a unit of noise of the
measured rate of that axis becomes in the same tick, N m s, with the noise of every tick its own.

- Time-delay estimation: the differences of the rate add up in N_hat to ``w h_bar v / delta`` for
  the noise v of the last tick; u adds ``h_bar K_D v`` (lambda for K_D with a sliding surface).
- Computed torque: ``H_S K_D v``, the noise of the other axes left out.
- With a boundary layer: ``(H_S lambda + g / Delta) v``.

Switching terms act on noise in a way that depends on its size: ``g sign(s)`` adds up to g, and
the roots of super-twisting and of the terminal sliding mode their ``h_bar K_1 |s|^1/2``. A torque
on the base is ``J0^T F``, about the base's axes, per unit of omega_base; rhodot is J0 of that.
Where nothing turns the base its axes have no torque, and the joints the inertia H_f of `inertia`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import ControlLaw
from space_robot_control.navigation.low_pass import low_pass_weight

from .inertia import attitude_jacobian
from .spectrum import Spectrum, spectrum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GainCheck:
    """The findings on one law."""

    law: str
    spectrum: Spectrum | None
    """None for a law without time-delay estimation."""
    noise_gain: Array
    """(m,) N m of torque per rad/s of noise on the rate of the same axis."""

    @property
    def is_sound(self) -> bool:
        """True unless the law estimates by time delay with too little margin."""
        return self.spectrum is None or self.spectrum.is_sound


def pair_corner(settings: ControllerNodeSettings) -> float:
    """Return the corner, Hz, of a low-pass that all of the time-delay pair passes (0: none).

    A navigation filter lets rates and torques lag alike, and so does the pair's own low-pass.
    """
    corners = [settings.acceleration_filter_hz]
    if settings.navigation == "filtered":
        own = settings.navigation_filter
        both = (own.rate_filter_hz, own.joint_bandwidth_hz)
        corners.append(max(both) if min(both) > 0.0 else 0.0)
    return min((corner for corner in corners if corner > 0.0), default=0.0)


def check_gains(
    law: ControlLaw, inertia: Array, quaternion: Array, acceleration_filter_hz: float = 0.0
) -> GainCheck:
    """Look at a law's gains.

    Args:
        law: with its gains and period.
        inertia: (K, m, m) H_S in the configurations that count; (K, n, n) H_f of the joints if
            nothing turns the base.
        quaternion: (4,) attitude that the base holds in all of them.
        acceleration_filter_hz: see `pair_corner`.
    """
    weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
    h_bar = law.h_bar[-inertia.shape[-1] :]
    eigen = spectrum(inertia, h_bar, weight) if h_bar.size else None
    return GainCheck(law.name, eigen, noise_gain(law, inertia, quaternion, weight))


def noise_gain(law: ControlLaw, inertia: Array, quaternion: Array, weight: float = 1.0) -> Array:
    """Return (m,) the torque per rad/s of white noise on each axis' rate, N m s.

    Args: see `check_gains`; ``weight`` is that of the low-pass.
    """
    axes = inertia.shape[-1]
    gains = {name: values[-axes:] for name, values in law.gain_values.items()}
    # the slope of a sliding surface stands where K_D does
    damping = gains.get("k_d", gains.get("lambda", np.zeros(axes)))
    if law.h_bar.size:
        per_rate = law.h_bar[-axes:] * (weight / law.period + damping)
    else:
        per_rate = np.diagonal(inertia, axis1=1, axis2=2).max(axis=0) * damping
        if {"g", "delta"} <= gains.keys():
            per_rate = per_rate + gains["g"] / gains["delta"]
    if axes < len(law.memory.s):  # the base has none
        return np.concatenate([np.zeros(3), per_rate])
    gain: Array = per_rate.copy()
    jacobian = attitude_jacobian(quaternion)
    gain[:3] = np.diag(jacobian.T @ np.diag(per_rate[:3]) @ jacobian)
    return gain
