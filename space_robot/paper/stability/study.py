"""Flights and results of a stability study of one law in one case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from space_robot_control.laws import laws
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ...flight.plan import NO_FRICTION, Flight, Scenario, resolve
from .lemma_1 import Contraction, contraction
from .reaching import off_mission_plan, reaching, ripple
from .super_twisting import SuperTwisting
from .time_delay_error import ErrorDerivative, error_derivative, time_delay_error

Fly = Callable[[Flight, str], FlightLog]
"""Flies a checked plan; the text names the flight of the study."""

SHORTEST = 10
"""Minimum number of ticks, for the derivatives."""


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


def check_law(flight: Flight) -> None:
    """Check that the study applies to the flight.

    Raises:
        InputError: the law has no time-delay estimation, or the flight is too short.
    """
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


def study(plan: Scenario, initial_error: float, fly: Fly) -> StabilityStudy:
    """Fly the flights of the study and check every condition of the paper.

    Args:
        plan: the flight; a second one is without friction.
        initial_error: e on every axis (eps: dimensionless, joints: rad) at the start of a third.
        fly: function that flies them.

    Raises:
        InputError: the plan's law has no time-delay estimation, or the flight is too short.
        FlightError: a flight diverged.
    """
    flight = Flight(resolve(plan))
    check_law(flight)
    gains, period = flight.controller.law.gain_values, flight.period
    h_bar = gains["h_bar"]
    log = fly(flight, "as planned")

    def derivative(of: FlightLog) -> ErrorDerivative:
        return error_derivative(time_delay_error(of, h_bar), period)

    error, frictionless = derivative(log), None
    if flight.scenario.has_friction:
        without = plan.with_parameters("plant", NO_FRICTION)
        frictionless = derivative(fly(Flight(resolve(without)), "without friction"))
    twisting = None
    if log.telemetry is not None and {"k_1", "k_2"} <= gains.keys():
        off = fly(Flight(resolve(off_mission_plan(flight, initial_error))), "from an initial error")
        twisting = SuperTwisting(
            k_1=gains["k_1"],
            k_2=gains["k_2"],
            beta=error.beta,
            initial_error=initial_error,
            reaching=reaching(off, gains["k_1"], ripple(log.telemetry[:, 0])),
            reaching_beta=derivative(off).beta,
        )
    walked = contraction(flight.plant.robot, h_bar, log)
    return StabilityStudy(flight, walked, error, frictionless, twisting)
