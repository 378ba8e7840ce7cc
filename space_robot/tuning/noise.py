"""Noise and lag of the laws' inputs: a simulation of sensors and navigation on a robot at rest.

The plant's sensors measure a robot at rest without torque and disturbance, and the controller's
navigation processes the measurements as in flight, so all variation is noise. A ramp of reported
torque passes the navigation at the same time, and shows its lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.laws import find_law
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

Array = NDArray[np.float64]

SETTLING = 2.0
"""Settling time of the filters, s."""
LISTENING = 4.0
"""Time over which noise is recorded, s."""
RAMP = 1e-3
"""Ramp of torque on every axis, N m/s; small, to avoid loss of digits."""


@dataclass(frozen=True)
class Noise:
    """Measured state of a robot at rest, after navigation."""

    rates: Array
    """(K, m) rhodot at every tick."""
    errors: Array
    """(K, m) e at every tick."""
    measured_rates: Array
    """(K, m) rhodot without the navigation's low-pass, as a time-delay estimate with the nominal
    inertia takes it."""
    lag: float
    """Largest delay of the reported torque over all axes, s."""
    period: float

    def acceleration(self, weight: float) -> Array:
        """Return the standard deviation (m,) of the time-delay pair's acceleration, rad/s2.

        Without filters white noise is overestimated by sqrt(2): in flight a difference of rates is
        correlated with the command that the last one caused.

        Args:
            weight: of the pair's low-pass.
        """
        deviation: Array = _acceleration(self.rates, weight, self.period).std(axis=0)
        return deviation

    def nominal_force(self, weight: float, inertia: Array) -> Array:
        """Return the standard deviation (m,) of ``H rhodd``, N m, the largest of all inertias.

        rhodd is that of the pair of a time-delay estimate with the nominal inertia.

        Args:
            weight: of the pair's low-pass.
            inertia: (K, m, m) H.
        """
        acceleration = _acceleration(self.measured_rates, weight, self.period)
        covariance = np.atleast_2d(np.cov(acceleration.T))
        variances = np.einsum("kij,jl,kil->ki", inertia, covariance, inertia)
        deviation: Array = np.sqrt(variances.max(axis=0))
        return deviation


def _acceleration(rates: Array, weight: float, period: float) -> Array:
    """Return the pair's acceleration (L, m) once its low-pass has settled."""
    from scipy.signal import lfilter  # slow to import

    differences = np.diff(rates, axis=0) / period
    smooth: Array = lfilter([weight], [1.0, weight - 1.0], differences, axis=0)
    return smooth[len(smooth) // 10 :]


def listen(
    robot: Robot,
    settings: PlantSettings,
    navigation: NavigationFilterSettings | None,
    mission: MissionSettings,
    period: float,
) -> Noise:
    """Simulate sensors and navigation of a robot at rest, and return noise and lag.

    Args:
        robot: with the right number of joints; its inertia does not matter.
        settings: of the plant, with sensors and joint positions.
        navigation: settings of the filter (None: the laws use the measurements).
        mission: settings of the reference.
        period: of the ticks, s.
    """
    quiet = settings.model_copy(update={"disturbance": DisturbanceSettings()})
    plant, command = Plant(robot, quiet, period), Command(0, np.zeros(robot.n + 3))
    kind = find_law("tde_stc")  # any law with an estimate: its command is not used
    gains = {name: np.ones(robot.n + 3) for name in kind.gain_descriptions()}
    law = kind({**gains, "h_bar": np.zeros(robot.n + 3)}, period)  # of the nominal inertia
    controller = Controller(robot, law, period, navigation=navigation)
    memory, held = controller.block[0], Mission(robot, mission, period).chunk(0, 1).references()
    first, last = round(SETTLING / period), round((SETTLING + LISTENING) / period)
    rates, errors, measured = np.empty((3, last - first, robot.n + 3))
    for tick in range(last):
        plant.state.applied_torque[:] = RAMP * period * tick
        controller.update(plant.state, held)
        if tick >= first:
            rates[tick - first] = controller.signals.rho_rate
            errors[tick - first] = controller.signals.error
            measured[tick - first] = memory.pair.rate
        command.tick = tick
        plant.step(command)
    lag = 0.0
    if navigation:
        late = memory.navigation.estimate.applied_torque
        lag = max(0.0, float(np.max((last - 1) * period - late / RAMP)))
    return Noise(rates, errors, measured, lag, period)
