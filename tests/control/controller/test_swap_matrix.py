"""Swaps in flight among all laws: from each to each other, without a jolt."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.analysis.metrics import tracking_error
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.controller.controller import TRANSFER_S, Controller
from space_robot_control.controller.gains import build_law
from space_robot_control.laws import ControlLaw, laws
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.records import assign

Array = NDArray[np.float64]

NOMINAL = [f"{name} nominal" for name, law in laws().items() if "h_bar" in law.gain_descriptions()]
LAWS = sorted([*laws(), *NOMINAL])
SWAP, STOP = 2000, 2100
"""Ticks: at 1 s the arm moves on all its joints; flown until 1.05 s."""


def name_of(law: str) -> str:
    """Without the inertia of its estimate."""
    return law.split()[0]


def flown(first: str, then: str) -> tuple[Flight, FlightLog]:
    """A flight with a swap; case 3 has disturbance and payload, which no law knows."""
    gains = {name_of(law): {"h_bar": ["nominal"]} for law in (first, then) if law in NOMINAL}
    flight = Flight(
        resolve(
            FlightPlan(
                controller=name_of(first),
                gains=gains or "default",
                case="3",
                swaps=[f"{SWAP * 5e-4}:{name_of(then)}"],
                duration=STOP * 5e-4,
            )
        )
    )
    return flight, simulate(flight)


def own_forces(flight: Flight, law: ControlLaw, log: FlightLog) -> tuple[Array, Array, Array]:
    """Forces F_S of the new law alone, (K, m), as if it took over from nothing, for the states of
    the flight from `SWAP` on; the force applied at the swap, and J0 of each tick."""
    controller = Controller(flight.robot, flight.law, flight.period)
    references = log.references(0, STOP)
    forces, jacobians = [], []
    for tick in range(SWAP - 2, STOP):
        if tick == SWAP:
            controller.law = law
            assign(controller.block[0], transfer_left=0.0)
        controller.update(log.state(tick), references[tick : tick + 1])
        if tick == SWAP:
            applied = controller.signals.applied_force.copy()
        if tick >= SWAP:
            forces.append(controller.block[0].force.copy())
            jacobians.append(controller.block[0].jacobian.copy())
    return np.array(forces), applied, np.array(jacobians)


def torques(jacobians: Array, forces: Array) -> Array:
    """``J^T F_S`` tick by tick."""
    base = np.einsum("kji,kj->ki", jacobians, forces[:, :3])
    return np.hstack([base, forces[:, 3:]])


@pytest.mark.parametrize("first", LAWS)
def test_every_law_takes_over_from_every_other_without_a_jolt(first: str) -> None:
    """The first torque is the one applied before, to rounding; then no step from tick to tick is
    larger than that of the new law alone and the share of a tick of the transfer in what the laws'
    forces differed by: ``|F_applied - F_law| / 40``. After it the torque is the law's own."""
    ticks = round(TRANSFER_S / 5e-4)
    for then in LAWS:
        if name_of(then) == name_of(first):
            continue
        flight, log = flown(first, then)
        law = build_law(name_of(then), flight.controller_settings, 9)
        law.gain_values = flight.laws[name_of(then)].gain_values
        own, applied, jacobians = own_forces(flight, law, log)
        torque = log.commanded_torque
        assert torque is not None
        steps = np.abs(np.diff(torque, axis=0))[SWAP - 1 :]
        alone = torques(jacobians, own)
        taken_over = (applied - own[0])[None]
        difference = np.abs(torques(jacobians[:1], taken_over))[0]
        rounding = 1e-14 * (np.abs(alone).max() + np.abs(applied).max())
        # F_S is carried over; the base turns on meanwhile, and J0 with it
        turn = (
            np.abs(np.diff(jacobians, axis=0)).max() * np.abs([*taken_over, applied])[:, :3].sum()
        )
        assert steps[0].max() <= turn + rounding, (first, then)
        of_law = np.abs(np.diff(alone, axis=0))[:ticks]
        bound = difference / ticks + of_law + turn + rounding
        assert (steps[1 : ticks + 1] <= bound).all(), (first, then)
        after = torque[SWAP + ticks :]
        np.testing.assert_allclose(after, alone[ticks:], rtol=0.0, atol=rounding, err_msg=then)
        error = np.abs(tracking_error(log))
        assert error[SWAP:].max() <= 2.0 * error[:SWAP].max() + 1e-4, (first, then)
