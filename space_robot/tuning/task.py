"""What a gain set is tuned for: requirements, robot, mission, noise.

`listen` has noise and lag of the laws' inputs: the plant's sensors measure a robot at rest without
torque and disturbance, and the controller's navigation processes the measurements as in flight, so
all variation is noise. A ramp of reported torque passes the navigation at the same time, and shows
its lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np

from space_robot_control.controller.controller import Controller
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.laws import find_law
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.component import Installation
from space_robot_sim.environment.disturbance import (
    Disturbance,
    DisturbanceSettings,
    disturbance_torque,
)
from space_robot_sim.environment.environment import EnvironmentSettings, with_payload
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

from .gain_check import eigenvalues
from .inertia import J0, SAMPLING, Posture, sampled_reference

CONSTANT, NOMINAL = "constant", "nominal"
"""Inertia of the laws with time-delay estimation: see `TuningOptions`."""
SEPARATION = 4.0
"""Ratio of the estimate's pole to the poles of the loop; see step 4 of `method`."""
MOST_BY_MODEL = 0.25
"""Largest bandwidth times period times eigenvalue of ``H_S^-1`` with the model's inertia, rad."""
MOST_PER_TICK = 0.05
"""Largest bandwidth times period, rad: K_D then removes a tenth of a rate error per tick."""
NEGLIGIBLE = 1e-9
"""Accelerations below this fraction of the largest one are rounding errors."""


@dataclass(frozen=True)
class TuningOptions:
    """Requirements on a gain set."""

    margin: float
    """Share by which the reported torque may exceed the commanded one."""
    mass_uncertainty: float
    """Share by which every mass and inertia may be wrong."""
    bandwidth: float | None = None
    """Bandwidth of all laws, rad/s; None: the largest that lag and ripple allow each law."""
    ripple: float = 0.1
    """Allowed RMS force by noise, as a share of the largest force of an axis."""
    h_bar: str = CONSTANT
    """Inertia of the laws with time-delay estimation: `CONSTANT` or `NOMINAL`."""


@dataclass(frozen=True)
class TuningTask:
    """Inputs of the method."""

    inertia: Array
    """(L, m, m) H_S in all configurations, with all payloads; L is a multiple of K."""
    postures: Sequence[Posture]
    """(K,) of the nominal robot in the same configurations."""
    demand: ForceDemand
    """Forces of the mission, on all axes."""
    options: TuningOptions
    period: float
    """s."""
    noise: Noise | None
    """Of sensors and navigation, with its lag; None: no noise, no lag."""
    has_gears: bool = False
    """True if some configurations are those of `flexible.fast_inertia`."""

    @cached_property
    def shape(self) -> Array:
        """(m,) d of step 1, kg m2."""
        return axis_inertia(self.inertia)

    @cached_property
    def nominal(self) -> Array:
        """(L, m, m) H_S of the nominal robot, kg m2."""
        own = np.array([posture.inertia for posture in self.postures])
        return np.tile(own, (len(self.inertia) // len(own), 1, 1))

    @cached_property
    def most_per_tick(self) -> float:
        """Largest bandwidth times period of the laws with a model, rad.

        The inertia of a motor before its gear, or of joints beside free hinges, may be much smaller
        than that of the model: K_D then removes more of a rate error per tick.
        """
        largest = float(eigenvalues(self.inertia, self.nominal).max())
        return min(MOST_PER_TICK, MOST_BY_MODEL / largest)

    @property
    def allowed(self) -> Array:
        """(m,) RMS force that noise may cause, N m."""
        return self.options.ripple * self.demand.peak

    @property
    def lag(self) -> float:
        """Of the navigation, s."""
        return self.noise.lag if self.noise else 0.0


def axis_inertia(inertia: Array) -> Array:
    """Return d_i (m,), the smallest ``1 / (H_S^-1)_ii`` of ``inertia`` (K, m, m), kg m2."""
    free = 1.0 / np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2)
    smallest: Array = free.min(axis=0)
    return smallest


@dataclass(frozen=True)
class ForceDemand:
    """Generalised forces F_S needed to follow a mission's reference, per axis (m,), N m."""

    peak: Array
    """Largest |F_S| over all environments."""
    slope: Array
    """Largest |dF_S/dt| without Coulomb friction, which has steps; N m/s."""
    unknown: Array
    """Largest difference from F_S of the nominal robot without environment."""
    nominal: Array
    """Largest |F_S| of the nominal robot without environment."""

    def on_all_axes(self, inertia: Array) -> ForceDemand:
        """Return the demand with nonzero values on the axes that the mission does not move.

        A planar motion would otherwise lead to zero gains on some axes. They get the force for the
        smallest acceleration of the other axes.

        Args:
            inertia: (m,) of each axis, kg m2.
        """
        return ForceDemand(*(_filled(force, inertia) for force in astuple(self)))


def _filled(force: Array, inertia: Array) -> Array:
    acceleration = force / inertia
    is_needed = acceleration > NEGLIGIBLE * acceleration.max()
    least = np.min(acceleration, where=is_needed, initial=np.inf)
    return np.where(is_needed, force, inertia * least) if is_needed.any() else force


def force_demand(
    robot: Robot, mission: MissionSettings, cases: Sequence[EnvironmentSettings]
) -> ForceDemand:
    """Return the largest forces of a mission over all ``cases``.

    Args:
        robot: the nominal robot.
        mission: settings of the reference.
        cases: environments with friction, disturbance and payload.
    """
    nominal = _smooth_force(robot, mission)
    smooth = [_smooth_force(with_payload(robot, case.payload), mission, case) for case in cases]
    coulomb = [_coulomb(robot, mission, case) for case in cases]
    whole = [force + friction for force, friction in zip(smooth, coulomb, strict=True)]
    slopes = [np.abs(np.diff(force, axis=0)).max(axis=0) / SAMPLING for force in smooth]
    return ForceDemand(
        peak=np.max([np.abs(force).max(axis=0) for force in whole], axis=0),
        slope=np.max(slopes, axis=0),
        unknown=np.max([np.abs(force - nominal).max(axis=0) for force in whole], axis=0),
        nominal=np.abs(nominal).max(axis=0),
    )


def _smooth_force(
    robot: Robot, settings: MissionSettings, case: EnvironmentSettings | None = None
) -> Array:
    """Return F_S (K, m) every `SAMPLING` s, without Coulomb friction; passive joints locked."""
    robot = robot.nominal
    chunk = sampled_reference(robot, settings)
    count = len(chunk.joints)
    rotation, model = np.empty((3, 3)), RhoSpaceModel.allocate(robot.n)
    as_desired = np.array([1.0, 0.0, 0.0, 0.0])
    disturbance = Disturbance.build(case.disturbance, Installation(robot.n)) if case else None
    force, torque = np.empty((count, robot.n + 3)), np.zeros(robot.n + 3)
    viscous = coefficients(robot, case.friction)[:, 1] if case else np.zeros(robot.n)
    for k, (theta, rates, accelerations) in enumerate(chunk.joints):
        omega, alpha = chunk.base[k, 4:7], chunk.base[k, 7:]
        rho_space_into(robot.model, as_desired, theta, omega, rates, omega, alpha, model)
        force[k] = model.inertia[:, 3:] @ accelerations + model.bias
        if case and disturbance is not None:
            disturbance_torque(disturbance, k * SAMPLING, torque)
            rotation_matrix(chunk.base[k, :4], rotation)
            force[k, :3] += rotation.T @ torque[:3] / J0
            force[k, 3:] += torque[3:] + viscous * rates
    return force


def _coulomb(robot: Robot, settings: MissionSettings, case: EnvironmentSettings) -> Array:
    rates = sampled_reference(robot, settings).joints[:, 1]
    force = np.zeros((len(rates), robot.n + 3))
    force[:, 3:] = coefficients(robot, case.friction)[: robot.n, 0] * np.sign(rates)
    return force


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
