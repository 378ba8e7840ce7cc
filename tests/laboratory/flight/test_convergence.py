"""A flight's figures are those of the laws and of physics, not of the plant's step."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

OUTER = slice(3, 6)
"""Joints 4-6."""


def fly(law: str, substeps: int) -> FlightLog:
    plan = FlightPlan(controller=law).with_parameters("plant", {"substeps": substeps})
    return simulate(Flight(resolve(plan)))


def errors(log: FlightLog) -> Array:
    """Mean-axis RMS of attitude (vector part), joints 1-3 and 4-6."""
    joints = log.reference_joints[:, 0] - log.joint_positions
    rms = np.sqrt(np.mean(joints**2, axis=0))
    attitude = np.sqrt(np.mean(log.quaternion[:, 1:] ** 2, axis=0))
    return np.array([attitude.mean(), rms[:3].mean(), rms[OUTER].mean()])


def figures(log: FlightLog) -> Array:
    """Errors, and total variation and RMS of every torque."""
    torque = log.applied_torque
    return np.concatenate(
        [errors(log), np.abs(np.diff(torque, axis=0)).sum(axis=0), np.sqrt(np.mean(torque**2, 0))]
    )


def variation_of_joint_6(log: FlightLog) -> float:
    """Total variation of its torque from 15 to 15.055 s, where it turns round, N m."""
    turning = slice(30_000, 30_111)
    return float(np.abs(np.diff(log.applied_torque[turning, 8])).sum())


@pytest.mark.parametrize("law", ["ctc", "ctc_smc", "tde_smc", "tde_stc"])
def test_a_quarter_of_the_step_gives_the_same_figures(law: str) -> None:
    """Of case 1, within 2 %; they agree far better."""
    coarse, fine = figures(fly(law, 1)), figures(fly(law, 4))
    np.testing.assert_allclose(coarse, fine, rtol=1e-4)


def test_tde_tsmc_is_as_near_as_its_last_bits_allow() -> None:
    """Its terms of fractional power amplify rounding: 1e-14 rad more at the start moves as much."""
    coarse, fine = errors(fly("tde_tsmc", 1)), errors(fly("tde_tsmc", 4))
    np.testing.assert_allclose(coarse[1:], fine[1:], rtol=0.04)
    assert max(coarse[0], fine[0]) < 2e-11


def test_joints_4_to_6_err_as_with_a_plant_of_256_steps_a_tick() -> None:
    """What a plant that evaluates the sign of the rate converges to."""
    stc, tsmc = fly("tde_stc", 1), fly("tde_tsmc", 1)
    assert errors(stc)[2] == pytest.approx(1.14e-8, rel=0.05)
    assert errors(tsmc)[2] == pytest.approx(2.05e-9, rel=0.05)
    assert 0.005 / 3.0 < variation_of_joint_6(stc) < 0.015


@pytest.mark.parametrize(
    ("substeps", "error", "variation"),
    [(1, 3.46e-8, 1.601), (4, 1.71e-8, 0.100), (16, 1.30e-8, 0.0154)],
)
def test_the_sign_inside_the_step_chatters_in_proportion_to_it(
    substeps: int, error: float, variation: float
) -> None:
    """Friction that is not set-valued, under TDE-STC: it nears the figures above step by step."""
    plan = FlightPlan(substeps=substeps).with_parameters("plant", {"friction.set_valued": False})
    log = simulate(Flight(resolve(plan)))
    assert errors(log)[2] == pytest.approx(error, rel=0.01)
    assert variation_of_joint_6(log) == pytest.approx(variation, rel=0.01)
