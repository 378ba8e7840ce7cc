"""Noise and lag of what the laws see: sensors and navigation run on a robot that stands still.

No formula for this sensor and that filter: the plant's own sensors measure a robot at rest, under
no torque and nothing that disturbs it, and the controller's own navigation makes of it what it
would in flight. All that moves then is noise. A ramp of torque is reported besides, as an echo, and
comes out of the navigation as late as the torque that belongs to its rates.
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
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]

SETTLING = 2.0
"""s given to the filters."""
LISTENING = 4.0
"""s over which noise is taken."""
RAMP = 1e-3
"""N m/s, on every axis; small, so that no number loses its digits to it."""


@dataclass(frozen=True)
class Noise:
    """A robot at rest as the laws see it."""

    rates: Array
    """(K, m) rhodot at every tick."""
    errors: Array
    """(K, m) e at every tick."""
    lag: float
    """By which the reported torque comes late, on the axis where it is latest; s."""
    period: float

    def acceleration(self, weight: float) -> Array:
        """Return (m,) the standard deviation of the time-delay pair's acceleration.

        ``weight`` is that of the pair's low-pass. Where nothing smooths, white noise is overrated
        by a root of 2: in flight a difference meets the command that the one before has made.
        """
        from scipy.signal import lfilter  # slow to import

        differences = np.diff(self.rates, axis=0) / self.period
        smooth = lfilter([weight], [1.0, weight - 1.0], differences, axis=0)
        deviation: Array = smooth[len(smooth) // 10 :].std(axis=0)
        return deviation


def listen(
    robot: Robot,
    settings: PlantSettings,
    navigation: NavigationFilterSettings | None,
    mission: MissionSettings,
    period: float,
) -> Noise:
    """Return the noise of a robot's sensors behind its navigation.

    Args:
        robot: any with the right number of joints: it stands still.
        settings: of the plant, with its sensors and where the arm is.
        navigation: settings of the filter (None: the laws see what is measured).
        mission: its reference.
        period: s.
    """
    quiet = settings.model_copy(update={"disturbance": DisturbanceSettings()})
    plant, command = Plant(robot, quiet, period), Command(0, np.zeros(robot.n + 3))
    kind = find_law("tde_stc")  # whichever: its command goes nowhere
    law = kind({name: np.ones(robot.n + 3) for name in kind.gain_descriptions()}, period)
    controller = Controller(robot, law, period, navigation=navigation)
    memory, held = controller.block[0], Mission(robot, mission, period).chunk(0, 1).references()
    first, last = round(SETTLING / period), round((SETTLING + LISTENING) / period)
    rates, errors = np.empty((2, last - first, robot.n + 3))
    for tick in range(last):
        plant.state.applied_torque[:] = RAMP * period * tick
        controller.update(plant.state, held)
        if tick >= first:
            rates[tick - first], errors[tick - first] = memory.rate, controller.signals.error
        command.tick = tick
        plant.step(command)
    lag = 0.0
    if navigation:
        late = memory.navigation.estimate.applied_torque
        lag = max(0.0, float(np.max((last - 1) * period - late / RAMP)))
    return Noise(rates, errors, lag, period)
