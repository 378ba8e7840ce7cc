"""Check of a law's gains along a mission, without flying it: stability margin and noise gain.

Each law gets two results: its **margin** against a wrong torque scale, if it uses time-delay
estimation (see `spectrum`), and its **noise gain** per axis: torque per unit of white noise of the
axis' measured rate in the same tick, N m s.

- Time-delay estimation: the differences of the rate sum up in N_hat to ``w h_bar v / delta`` for
  the noise v of the last tick; u adds ``h_bar K_D v`` (lambda for K_D with a sliding surface).
- Computed torque: ``H_S K_D v``, without the noise of the other axes.
- With a boundary layer: ``(H_S lambda + g / Delta) v``.

The effect of noise on switching terms depends on its size: ``g sign(s)`` adds up to g, and the
roots of super-twisting and of the terminal sliding mode add ``h_bar K_1 |s|^1/2``. The torque on
the base, about its axes, is ``J0^T F``, and rhodot is ``J0 omega_base``. A base without attitude
actuators has no torques, and the joints have the inertia H_f of `inertia`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import ControlLaw
from space_robot_control.navigation.low_pass import low_pass_weight

from .flexible import FlexibleCheck
from .inertia import attitude_jacobian
from .spectrum import Spectrum, spectrum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GainCheck:
    """Result of the check of one law."""

    law: str
    spectrum: Spectrum | None
    """Eigenvalues and margin; None for a law without time-delay estimation."""
    noise_gain: Array
    """(m,) torque per unit of noise on the rate of the same axis, N m s."""
    flexible: FlexibleCheck | None = None
    """Stability on a robot with gears; None for one without."""

    @property
    def is_sound(self) -> bool:
        """False if time-delay estimation has too little margin, or a gear's spring oscillates."""
        return self.has_margin and self.is_stable

    @property
    def has_margin(self) -> bool:
        """False if the law uses time-delay estimation with too little margin."""
        return self.spectrum is None or self.spectrum.is_sound

    @property
    def is_stable(self) -> bool:
        """False if small oscillations of a gear's spring grow."""
        return self.flexible is None or self.flexible.is_stable


def pair_corner(settings: ControllerNodeSettings) -> float:
    """Return the corner, Hz, of the low-pass of the whole time-delay pair (0: none).

    It is the pair's own low-pass or the navigation filter: both delay rates and torques equally.
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
    """Compute margin and noise gain of a law.

    Args:
        law: with its gains and period.
        inertia: (K, m, m) H_S in all configurations; (K, n, n) H_f of the joints for a base
            without attitude actuators.
        quaternion: (4,) attitude of the base in all configurations.
        acceleration_filter_hz: see `pair_corner`.
    """
    weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
    h_bar = law.h_bar[-inertia.shape[-1] :]
    eigen = spectrum(inertia, h_bar, weight) if h_bar.size else None
    return GainCheck(law.name, eigen, noise_gain(law, inertia, quaternion, weight))


def noise_gain(law: ControlLaw, inertia: Array, quaternion: Array, weight: float = 1.0) -> Array:
    """Return the torque (m,) per unit of white noise on each axis' rate, N m s.

    Args:
        law: with its gains and period.
        inertia: (K, m, m) H_S, or (K, n, n) H_f, see `check_gains`.
        quaternion: (4,) attitude of the base.
        weight: of the low-pass of the time-delay pair; 1: none.
    """
    axes = inertia.shape[-1]
    gains = {name: values[-axes:] for name, values in law.gain_values.items()}
    # the slope of a sliding surface has the role of K_D
    damping = gains.get("k_d", gains.get("lambda", np.zeros(axes)))
    if law.h_bar.size:
        per_rate = law.h_bar[-axes:] * (weight / law.period + damping)
    else:
        per_rate = np.diagonal(inertia, axis1=1, axis2=2).max(axis=0) * damping
        if {"g", "delta"} <= gains.keys():
            per_rate = per_rate + gains["g"] / gains["delta"]
    if axes < len(law.memory.s):  # no torque on the base
        return np.concatenate([np.zeros(3), per_rate])
    gain: Array = per_rate.copy()
    jacobian = attitude_jacobian(quaternion)
    gain[:3] = np.diag(jacobian.T @ np.diag(per_rate[:3]) @ jacobian)
    return gain
