"""The flights and the numbers of a stability study of one law on one case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from space_robot_control.laws import laws
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ...flight.plan import NO_FRICTION, Flight, FlightPlan, resolve
from .lemma_1 import Contraction, contraction
from .reaching import off_mission_plan, reaching, ripple
from .super_twisting import SuperTwisting
from .time_delay_error import ErrorDerivative, error_derivative, time_delay_error

Fly = Callable[[Flight, str], FlightLog]
"""Flies a checked plan; the text says which flight of the study it is."""

SHORTEST = 10
"""Ticks; fewer leave nothing to differentiate."""


@dataclass(frozen=True)
class StabilityStudy:
    """The findings; `super_twisting` for laws with K_1 and K_2 only."""

    flight: Flight
    lemma_1: Contraction
    error: ErrorDerivative
    frictionless_error: ErrorDerivative | None
    """The same flight without friction; None if there was none to leave out."""
    super_twisting: SuperTwisting | None

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the m axes."""
        return self.flight.robot.axis_names


def check_law(flight: Flight) -> None:
    """Check that the study has something to say of the flight's law.

    Raises:
        InputError: the law does without time-delay estimation, or the flight is too short.
    """
    law = flight.controller.law
    if not law.uses_time_delay_estimate():
        fitting = [name for name, cls in laws().items() if cls.uses_time_delay_estimate()]
        raise InputError(
            f"controller {law.name!r} has no gain h_bar: the paper's stability analysis is that "
            f"of time-delay estimation, choose one of {', '.join(sorted(fitting))}"
        )
    if flight.ticks < SHORTEST:
        raise InputError(
            f"duration must be at least {SHORTEST} ticks ({SHORTEST * flight.period:g} s) "
            f"for a stability study, got {flight.ticks}"
        )


def study(plan: FlightPlan, initial_error: float, fly: Fly) -> StabilityStudy:
    """Fly what is needed and check every condition of the paper.

    Args:
        plan: the flight; its friction is left out in a second one.
        initial_error: e on every axis (eps: dimensionless, joints: rad) at the start of a third.
        fly: flies them.

    Raises:
        InputError: the plan's law has no time-delay estimate, or the flight is too short.
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
