"""The paper's stability analysis (Section III-C, Appendices A and B) of a law in flight.

A law is flown as planned, without friction, and from an initial error. From the logs come

- norm and radius of ``W = E - H_S^-1 h_bar`` (69), Lemma 1. By (68) the time-delay error obeys
  ``eps(t) = W eps(t - delta) + chi(t - delta)``. The lemma requires a spectral norm of W below 1.
  W is not symmetric, but ``H_S^1/2 W H_S^-1/2`` is: the spectral radius of W is its norm induced by
  H_S. If it is below 1, W contracts in that norm even if not in the Euclidean one.
- the time-delay error ``eps = h_bar^-1 (N - N_hat)`` (65), the error of the estimate in units of
  acceleration, with ``N = F_S - h_bar rhodd`` (33), and the bound beta of its derivative. A command
  of tick k acts until tick k+1, and the mean acceleration over it is
  ``(rhodot_k+1 - rhodot_k) / delta``. This beta is that of the closed loop: by (70) chi contains
  ``W (u(t) - u(t - delta))``, and u ``K_1 |s|^1/2 sign(s)``, whose slope at s = 0 is infinite, so
  beta depends on the gains that it is compared with. Friction adds jumps where a joint starts.
- the reaching phase (53)-(56). The state of (46) is ``eta = [|s|^1/2 sign(s), psi]``. Its psi is
  *not* the integral in the law (42), which is on the other side of (44): ``psidot = -K_2 sign(s) +
  epsdot`` (45). Here it is measured by the first line of (46), ``psi = sdot + K_1 |s|^1/2 sign(s)``
  with sdot the mean over a tick.

All conditions are sufficient: if one fails, neither stability nor instability is proven.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot.analysis.errors import neglected_force
from space_robot_control.laws import laws
from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..flight.plan import NO_FRICTION, Flight, Scenario, resolve
from ..tuning.gain_check import contraction_matrix
from .lyapunov import Certificate, certify, largest_tolerated_beta, paper_m, peak_gain, residual

Fly = Callable[[Flight, str], FlightLog]
"""Flies a checked plan; the text names the flight of the study."""

SHORTEST = 10
"""Minimum number of ticks, for the derivatives."""
LEMMA_1_EVERY_S = 0.02
"""Time between two configurations in which W is evaluated, s."""
REACHED = 0.01
"""Share of |s(0)| below which the sliding surface counts as reached."""
RIPPLE_PERCENTILE = 99.9
"""Percentile of |s| in a flight without initial error that defines the ripple of s, %."""
DWELL = 1.0
"""Time for which |s| must stay small, s; later, friction may push a joint off the surface."""


class Check(NamedTuple):
    """An inequality of the paper, ``value < limit``; NaN stands for an unknown number."""

    value: float
    limit: float
    applies: bool = True
    """False if an assumption of the limit does not hold."""

    @property
    def holds(self) -> bool | None:
        """True if ``value < limit``; None if a number is unknown, or the limit not applicable."""
        if not self.applies or math.isnan(self.value) or math.isnan(self.limit):
            return None
        return self.value < self.limit

    @property
    def verdict(self) -> str:
        """Result as text."""
        if not self.applies:
            return "not applicable"
        return {True: "holds", False: "fails", None: "open"}[self.holds]


class Extremes(NamedTuple):
    """Largest and smallest value over a flight, and their times."""

    max: float
    max_at_s: float
    min: float
    min_at_s: float

    @property
    def below_one(self) -> Check:
        """The condition of Lemma 1."""
        return Check(self.max, 1.0)


class Contraction(NamedTuple):
    """Spectral norm (as Lemma 1 is printed) and spectral radius of W over a flight.

    The recursion (68) needs the radius below 1 at a fixed configuration.
    """

    norm: Extremes
    radius: Extremes


def flown_inertia(robot: Robot, log: FlightLog, ticks: NDArray[np.intp]) -> Array:
    """Return H_S (K, m, m) of ``robot`` at ``ticks`` (K,) of a flight, passive joints locked."""
    inertia, model = np.empty((len(ticks), log.axes, log.axes)), RhoSpaceModel.allocate(robot.n)
    error, still = np.zeros(4), np.zeros(3)
    for k, tick in enumerate(ticks):
        attitude_error_into(log.reference_base[tick, :4], log.quaternion[tick], error)
        joints = log.joint_positions[tick], log.omega_base[tick], log.joint_velocities[tick]
        rho_space_into(robot.nominal.model, error, *joints, still, still, model)
        inertia[k] = model.inertia
    return inertia


def contraction(robot: Robot, h_bar: Array, log: FlightLog) -> Contraction:
    """Return norm and radius of W along a flight, with the diagonal (m,) of h_bar.

    The ``robot`` is the one that flew, with its payload.
    """
    period = log.timebase.period
    ticks = np.arange(0, log.ticks, max(1, round(LEMMA_1_EVERY_S / period)))
    w = contraction_matrix(flown_inertia(robot, log, ticks), h_bar)

    def extremes(values: Array) -> Extremes:
        places = [int(np.argmax(values)), int(np.argmin(values))]
        pairs = np.column_stack([values[places], ticks[places] * period])
        return Extremes(*pairs.ravel().tolist())

    radius = np.max(np.abs(np.linalg.eigvals(w)), axis=1)
    return Contraction(extremes(np.linalg.norm(w, 2, axis=(1, 2))), extremes(radius))


@dataclass(frozen=True)
class ErrorDerivative:
    """Largest values of eps and its derivative, per axis (m,)."""

    max_error: Array
    """Largest |eps|, rad/s2 (eps: 1/s2)."""
    beta: Array
    """Largest |eps_k+1 - eps_k| / delta, rad/s3 (eps: 1/s3)."""
    beta_at_s: Array
    """Time of this maximum, s."""
    beta_99_9_percentile: Array
    """99.9th percentile of the same, which ignores jumps in up to 0.1 % of the ticks."""


def time_delay_error(log: FlightLog, h_bar: Array) -> Array:
    """Return eps (N-1, m) over the interval after each tick, of a flight with telemetry.

    Before tick 1 there is no estimate, so row 0 has N_hat = 0.
    """
    assert log.telemetry is not None
    error: Array = (neglected_force(log, h_bar) - log.telemetry[:-1, 2]) / h_bar
    return error


def error_derivative(error: Array, period: float) -> ErrorDerivative:
    """Return the bounds of ``error`` (N-1, m), sampled every ``period`` s, without row 0."""
    estimated = error[1:]
    derivative = np.abs(np.diff(estimated, axis=0)) / period
    return ErrorDerivative(
        max_error=np.max(np.abs(estimated), axis=0),
        beta=np.max(derivative, axis=0),
        beta_at_s=(np.argmax(derivative, axis=0) + 2).astype(np.float64) * period,
        beta_99_9_percentile=np.percentile(derivative, 99.9, axis=0),
    )


@dataclass(frozen=True)
class Reaching:
    """Reaching phase of a flight from an initial error, per axis."""

    time: Array
    """(K,) time, s."""
    eta: Array
    """(K, m, 2) state of (46)."""
    threshold: Array
    """(m,) |s| below which the surface counts as reached, rad/s (eps: 1/s)."""
    measured: Array
    """(m,) reaching time, s; NaN if the surface was not reached."""


def off_mission_plan(flight: Flight, initial_error: float) -> Scenario:
    """Return the plan of ``flight``, started at rest with ``e = initial_error`` on every axis."""
    start = flight.mission.chunk(0, 1)
    eps = start.base[0, 1:4] - initial_error
    eta = np.copysign(np.sqrt(1.0 - eps @ eps), start.base[0, 0])
    plant: dict[str, Any] = {
        "initial_quaternion": [float(eta), *eps.tolist()],
        "initial_joints_deg": flight.robot.to_degrees(start.joints[0, 0] - initial_error).tolist(),
    }
    return flight.scenario.options.with_parameters("plant", plant)


def ripple(s: Array) -> Array:
    """Return a high percentile (m,) of |``s``| (N, m): the ripple caused by sampling."""
    return np.asarray(np.percentile(np.abs(s), RIPPLE_PERCENTILE, axis=0))


def lyapunov_state(s: Array, k_1: Array, period: float) -> Array:
    """Return eta of (47), (N-1, m, 2), from ``s`` (N, m) and ``k_1`` (m,)."""
    root = np.sqrt(np.abs(s[:-1])) * np.sign(s[:-1])
    psi = np.diff(s, axis=0) / period + k_1 * root
    return np.asarray(np.stack([root, psi], axis=-1))


def arrival(s: Array, threshold: Array, period: float) -> Array:
    """Return the time (m,), s, from which |s| stays below ``threshold`` for `DWELL`; or NaN."""
    ticks, times = max(1, round(DWELL / period)), np.full(s.shape[1], np.nan)
    for axis, is_outside in enumerate((np.abs(s) > threshold).T):
        edges = np.concatenate([[-1], np.flatnonzero(is_outside), [len(s)]])
        long_enough = np.flatnonzero(np.diff(edges) > ticks)
        if len(long_enough):
            times[axis] = (edges[long_enough[0]] + 1) * period
    return times


def reaching(log: FlightLog, k_1: Array, undisturbed: Array) -> Reaching:
    """Measure when a flight with K_1 (m,) from an initial error reaches the sliding surface.

    ``undisturbed`` (m,) is the `ripple` of the flight without an initial error.
    """
    assert log.telemetry is not None
    s, period = log.telemetry[:, 0], log.timebase.period
    threshold = np.maximum(REACHED * np.abs(s[0]), undisturbed)
    eta = lyapunov_state(s, k_1, period)
    time = np.arange(len(eta), dtype=np.float64) * period
    return Reaching(time, eta, threshold, arrival(s, threshold, period))


class AxisConditions(NamedTuple):
    """Conditions of Sections III-B, III-C and Appendix B on K_1 and K_2 of one axis."""

    k_1: float
    k_2: float
    beta: float
    """Measured bound of |epsdot|."""
    tolerated_beta: float
    """Largest beta for which (73) and (51) hold."""
    beta_below_k_2: Check
    four_k_2_below_k_1_squared: Check
    circle_criterion: Check
    """(73): ``max |G(j omega)| < 1 / beta``."""
    paper_m_residual: Check
    """(51) with M of (48), gamma = 0 and beta = 0, the weakest condition: below 0."""
    paper_m_eigenvalues: Array
    """(2,) eigenvalues of the M of (48)."""
    measured: Certificate | None
    """Solution of (51) for the measured beta; None where it is too large."""
    assumed: Certificate | None
    """Solution of (51) for half of the tolerated beta: K_2 / 2 if ``K_1^2 >= 4 K_2``."""
    initial_value: float
    """V(0) of the flight from the initial error; NaN without a solution M."""
    reaching_beta: float
    """Bound of |epsdot| in that flight."""
    reaching_time: Check
    """(56): below its bound; unknown if the flight is too short, not applicable if beta is more."""

    @property
    def certificate(self) -> Certificate | None:
        """The solution for the measured beta, or for the assumed one where there is none."""
        return self.measured or self.assumed


class SuperTwisting(NamedTuple):
    """The flight from an initial error, and the conditions on each axis."""

    initial_error: float
    reaching: Reaching
    axes: list[AxisConditions]


def axis_conditions(
    k_1: float, k_2: float, beta: float, reaching_beta: float, reaching: Reaching, axis: int
) -> AxisConditions:
    """Check the conditions on one axis, see `AxisConditions`."""
    tolerated, m = largest_tolerated_beta(k_1, k_2), paper_m(k_1, k_2)
    measured, assumed = certify(k_1, k_2, beta), certify(k_1, k_2, 0.5 * tolerated)
    certificate = measured or assumed
    initial, bound, arrived = math.nan, math.nan, float(reaching.measured[axis])
    if certificate:
        initial = float(certificate.value(reaching.eta[0, axis]))
        bound = certificate.reaching_time(initial)
    if math.isnan(arrived) and reaching.time[-1] >= bound:
        arrived = math.inf
    is_kept = certificate is not None and reaching_beta <= certificate.beta
    return AxisConditions(
        k_1,
        k_2,
        beta,
        tolerated,
        Check(beta, k_2),
        Check(4.0 * k_2, k_1**2),
        Check(peak_gain(k_1, k_2), 1.0 / beta if beta > 0.0 else math.inf),
        Check(residual(m, k_1, k_2, beta=0.0, gamma=0.0), 0.0),
        np.asarray(np.linalg.eigvalsh(m), dtype=np.float64),
        measured,
        assumed,
        initial,
        reaching_beta,
        Check(arrived, bound, is_kept),
    )


@dataclass(frozen=True)
class StabilityStudy:
    """Results of a study; `super_twisting` only for laws with K_1 and K_2."""

    flight: Flight
    lemma_1: Contraction
    error: ErrorDerivative
    frictionless_error: ErrorDerivative | None
    """The same flight without friction; None if the flight has no friction."""
    super_twisting: SuperTwisting | None

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the m axes."""
        return self.flight.robot.axis_names


def study(plan: Scenario, initial_error: float, fly: Fly) -> StabilityStudy:
    """Fly the flights of the study and check every condition of the paper.

    They are ``plan``, the same without friction, and from ``initial_error``, e on every axis
    (eps: dimensionless, joints: rad).

    Raises:
        InputError: the plan's law has no time-delay estimation, or the flight is too short.
        FlightError: a flight diverged.
    """
    flight = Flight(resolve(plan))
    _check_law(flight)
    gains, period = flight.controller.law.gain_values, flight.period
    h_bar = gains["h_bar"]
    log = fly(flight, "as planned")

    def derivative(flown: FlightLog) -> ErrorDerivative:
        return error_derivative(time_delay_error(flown, h_bar), period)

    error, frictionless = derivative(log), None
    if flight.scenario.has_friction:
        without = plan.with_parameters("plant", NO_FRICTION)
        frictionless = derivative(fly(Flight(resolve(without)), "without friction"))
    twisting = None
    if log.telemetry is not None and {"k_1", "k_2"} <= gains.keys():
        off = fly(Flight(resolve(off_mission_plan(flight, initial_error))), "from an initial error")
        reached = reaching(off, gains["k_1"], ripple(log.telemetry[:, 0]))
        columns = np.stack([gains["k_1"], gains["k_2"], error.beta, derivative(off).beta], axis=1)
        axes = [
            axis_conditions(k_1, k_2, beta, reaching_beta, reached, axis)
            for axis, (k_1, k_2, beta, reaching_beta) in enumerate(columns.tolist())
        ]
        twisting = SuperTwisting(initial_error, reached, axes)
    lemma_1 = contraction(flight.plant.robot, h_bar, log)
    return StabilityStudy(flight, lemma_1, error, frictionless, twisting)


def _check_law(flight: Flight) -> None:
    law = flight.controller.law
    if not law.h_bar.any():
        fitting = [name for name, cls in laws().items() if "h_bar" in cls.gain_descriptions()]
        raise InputError(
            f"controller {law.name!r} has no constant h_bar: the paper's stability analysis is for "
            f"time-delay estimation with one, choose one of {', '.join(sorted(fitting))}"
        )
    if flight.ticks < SHORTEST:
        raise InputError(
            f"duration must be at least {SHORTEST} ticks ({SHORTEST * flight.period:g} s) "
            f"for a stability study, got {flight.ticks}"
        )
