"""Navigation, allocation, statistics of campaigns, and bits: what decides in the software."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from allocation_bench import least, loads_of
from attitude_sensors import Case, attitude_error, filtered, measure, riccati, turned_by
from benches import random_thrusters
from matrix.scenarios import OF_THE_PROCESS, PLANS, columns_of, in_root, numbers
from numpy.typing import NDArray
from rows import SCIPY, ValidationRow, relative
from scipy.optimize import linprog
from scipy.stats import binomtest, chi2

from space_robot.campaign.verdicts.laws import quantile
from space_robot.campaign.verdicts.requirements import FixedSample, Sequential
from space_robot.flight.batch import FlightBatch
from space_robot.flight.capability import ThrusterTorques
from space_robot_control.navigation.attitude_filter import propagate_covariance, update
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH

Array = NDArray[np.float64]
SEEDS, TICKS = 200, 2_500
DEMANDS = 300
CAMPAIGNS, RUNS = 2_000, 1_000
FLOWN = ("as_shipped", "swaps_on_wheels", "thrusters_stick", "magnetic_unloading")
"""Scenarios of the tests' matrix."""


def navigation() -> Iterator[ValidationRow]:
    """Compare the attitude filter's errors with its own covariance, and that with Riccati's."""
    case = Case(1e-5, 6e-5, 1e-6, 2e-8, 2e-5, period=0.01, interval=10, delay=13)

    def rate(t: float) -> Array:
        return np.radians(3.0) * np.array([np.cos(0.3 * t), 0.5, np.sin(0.2 * t)])

    attitudes = turned_by(rate, TICKS, case.period)
    rates = np.array([rate(case.period * k) for k in range(TICKS)])
    squares = []
    for seed in range(SEEDS):
        measured = measure(case, attitudes, rates, np.random.default_rng(seed))
        known = filtered(case, measured)
        turned = attitude_error(known.delayed[-1], attitudes[-1 - case.delay])
        error = np.r_[turned, measured.bias[-1 - case.delay] - known.bias[-1]]
        squares.append(error @ np.linalg.solve(known.covariance[-1], error) / 6.0)
    low, high = chi2.ppf([0.005, 0.995], 6 * SEEDS) / (6 * SEEDS)
    name, extent = "attitude filter: mean NEES of a number, less 1", f"{SEEDS} flights of 25 s"
    off, limit = abs(float(np.mean(squares)) - 1.0), float(min(1.0 - low, high - 1.0))
    yield ValidationRow(name, "chi square, 99 %", extent, off, limit)
    still = Case(period=0.02, interval=5)
    steady, filter = riccati(still, np.zeros(3)), still.filter()
    filter.quaternion[:], filter.covariance[:] = [0.5, -0.5, 0.5, 0.5], steady
    update(filter, filter.quaternion, True)
    for _ in range(still.interval):
        propagate_covariance(filter, still.period)
    sigma = np.sqrt(np.diag(steady))
    scale = np.outer(sigma, sigma)
    name, extent = "attitude filter: steady covariance", "one measurement"
    off = relative(filter.covariance / scale, steady / scale)
    yield ValidationRow(name, SCIPY, extent, off, 1e-9)


def allocation() -> Iterator[ValidationRow]:
    """Compare the largest load of wheels, and the propellant of thrusters."""
    of_wheels, of_thrusters = 0.0, 0.0
    for seed in range(DEMANDS):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(3, 9))
        axes, wanted = rng.normal(size=(count, 3)), rng.normal(size=3)
        full = rng.uniform(0.2, 3.0, count)
        largest = float(np.abs(loads_of(axes, full, wanted)).max())
        of_wheels = max(of_wheels, relative([largest], [least(axes, full, wanted)]))
        thrusters = random_thrusters(rng, count).thrusters
        rates, torques = thrusters.mass_flow, thrusters.torques
        own = ThrusterTorques.of(thrusters).propellant(wanted[np.newaxis])
        solved = linprog(rates, A_eq=torques.T, b_eq=wanted, bounds=(0.0, None))
        of_thrusters = max(of_thrusters, relative(own, [solved.fun]))
    against, extent = SCIPY, f"{DEMANDS} random sets"
    yield ValidationRow("wheels: least largest load", against, extent, of_wheels, 1e-6)
    yield ValidationRow("thrusters: least propellant", against, extent, of_thrusters, 1e-6)


def statistics() -> Iterator[ValidationRow]:
    """Compare limits of shares, and count how often intervals and verdicts are false."""
    largest, rng = 0.0, np.random.default_rng(1)
    for _ in range(DEMANDS):
        runs = int(rng.integers(1, 2_000))
        events, confidence = int(rng.integers(0, runs + 1)), float(rng.uniform(0.5, 0.999))
        own = FixedSample(0.9, confidence).upper_limit(events, runs)
        test = binomtest(events, runs, alternative="less")
        exact = test.proportion_ci(confidence, method="exact").high
        largest = max(largest, abs(own - exact))
    name, extent = "campaign: confidence limit of a share", f"{DEMANDS} random counts"
    yield ValidationRow(name, SCIPY, extent, largest, 1e-9)
    holds = [
        own.low <= 0.0 <= own.high
        for own in (quantile(values, 0.5) for values in rng.normal(size=(10 * CAMPAIGNS, 35)))
    ]
    name, extent = "campaign: 95 % intervals that miss the median", f"{len(holds)} of 35 flights"
    missed, limit = 1.0 - float(np.mean(holds)), beyond(0.05, len(holds))
    yield ValidationRow(name, "simulation", extent, missed, limit)
    test = Sequential(0.99, 0.9)
    failures = np.cumsum(rng.random((CAMPAIGNS, RUNS)) < 1.0 - test.share, axis=1)
    met = test.is_met(failures, np.arange(1, RUNS + 1)).any(axis=1)
    name, extent = ("campaign: false verdicts at 90 %", f"{CAMPAIGNS} of {RUNS} flights")
    yield ValidationRow(name, "simulation", extent, float(met.mean()), beyond(0.1, CAMPAIGNS))


def beyond(share: float, cases: int) -> float:
    """Return a share that is exceeded in one of 700 simulations if it is right."""
    return share + 3.0 * float(np.sqrt(share * (1.0 - share) / cases))


def differing(log: FlightLog, expected: FlightLog) -> tuple[int, int]:
    """Return how many bits of two logs differ, and of how many."""
    count = total = 0
    here = columns_of(log)
    for name, column in columns_of(expected).items():
        if name not in OF_THE_PROCESS:
            one, other = (np.frombuffer(numbers(c), np.uint8) for c in (here[name], column))
            count += int(np.unpackbits(one ^ other).sum())
            total += 8 * one.size
    return count, total


def bits() -> Iterator[ValidationRow]:
    """Compare flights in Python, in lanes among seven others, and with the flight software in C."""
    in_lanes, in_c = np.zeros(2, int), np.zeros(2, int)
    with in_root():
        for plan in (PLANS[name] for name in FLOWN):
            expected = plan.scenario.fly()
            law = expected.flight.law
            gains = {} if "gains" in plan.options else {law.name: law.gain_values}
            others = [plan.scenario.replace(**plan.neighbour(k, gains)) for k in range(1, WIDTH)]
            flights = [one.check() for one in (plan.scenario, *others)]
            log = next(b.log for b in FlightBatch(flights).fly() if b.flight == 0)
            in_lanes += differing(log, expected.log)
            in_c += differing(plan.scenario.replace(controller_code="c").fly().log, expected.log)
    for name, (count, total) in (("in lanes", in_lanes), ("with software in C", in_c)):
        extent = f"{len(FLOWN)} flights, {total / 1e6:.1f} million bits"
        title = f"flights {name}: bits that differ"
        yield ValidationRow(title, "flights in Python", extent, float(count), 0.0)
