"""Friction of a joint with a gear acts on its motor: links swing while their motors stand.

The link's own phase error is far below 1e-9 with the steps used here, see `test_gear_oscillator`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from geared_robots import HEAVY, PERIOD, GearedFlight, oscillator
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from space_robot_model.robot.tree import Gear
from space_robot_sim.plant.stick_slip import slip_or_stick

Array = NDArray[np.float64]

SUBSTEPS = 8
GEAR = Gear(2e-5, 100.0, 150.0)
MOTOR, LINK, BASE = 0.2, 0.5, 3.0
"""B, I of the link, and I of the base with the rotor, kg m2."""


@pytest.mark.parametrize("base", [HEAVY, BASE])
@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_a_link_swings_on_a_motor_that_stands(base: float, damping: float) -> None:
    """With ``sqrt(K / I)``, and ``sqrt(K (1 / I + 1 / I_base))`` where the base is free.

    The motor stands to the last bit, and its friction takes nothing from the swing.
    """
    coulomb, stretched, ticks = 20.0, 0.1, 2000
    flight = GearedFlight(
        oscillator(GEAR._replace(damping=damping), LINK, base), SUBSTEPS, coulomb, viscous=3.0
    )
    flight.positions[0], flight.motor_positions[0] = 0.3 - stretched, 0.3
    lighter = 1.0 / LINK + 1.0 / base
    decay = 0.5 * damping * lighter
    pulsation = np.sqrt(GEAR.stiffness * lighter - decay**2)
    for _ in range(ticks // 50):
        truth = flight.rest(50)
        assert truth.motor_velocities[0] == 0.0
        assert truth.motor_positions[0] == 0.3
        t = flight.plant.tick * PERIOD
        swing = np.cos(pulsation * t) + decay / pulsation * np.sin(pulsation * t)
        expected = 0.3 - stretched * np.exp(-decay * t) * swing
        assert truth.joint_positions[0] == pytest.approx(expected, rel=0.0, abs=1e-10)
    assert ticks * PERIOD * pulsation > 10.0


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_a_motor_breaks_away_where_torque_less_spring_exceeds_its_friction(sense: float) -> None:
    coulomb, stretched = 5.0, 0.02
    for excess in (-1e-9, 1e-9):
        flight = GearedFlight(oscillator(GEAR, LINK), SUBSTEPS, coulomb)
        flight.positions[0] = -sense * stretched  # the spring pulls the motor back
        pulled = GEAR.stiffness * stretched
        memory = flight.plant.memory
        memory.stages.actuation[6] = sense * (coulomb + pulled) * (1.0 + excess)
        slip_or_stick(memory.model, memory.environment, memory.x, 0.0, memory.stages)
        acceleration = memory.stages.slope[0, 14 + 1]
        assert np.sign(acceleration) == (sense if excess > 0.0 else 0.0)


def test_the_brake_holds_the_motor_on_a_base_that_turns() -> None:
    """``tau - tau_s - N J z . wdot_p``, of which the last is the base's own acceleration."""
    torque, of_base, stretched = 1.5, 2.0, 0.03
    flight = GearedFlight(oscillator(GEAR, LINK, BASE), SUBSTEPS, coulomb=50.0)
    flight.positions[0] = -stretched
    memory = flight.plant.memory
    memory.stages.actuation[5], memory.stages.actuation[6] = of_base, torque
    slip_or_stick(memory.model, memory.environment, memory.x, 0.0, memory.stages)
    spring = GEAR.stiffness * stretched
    turning = (of_base - spring) / BASE  # the locked rotor is a part of the base
    stages: Any = memory.stages
    coupled = GEAR.ratio * GEAR.rotor_inertia * turning
    assert stages["data"].holding[1] == pytest.approx(torque - spring - coupled, rel=1e-13)
    assert memory.stages.slope[0, 13] == pytest.approx(turning, rel=1e-13)


def test_a_thrown_motor_comes_to_rest_when_and_where_it_should() -> None:
    """By SciPy's events: it slides to rest, stands, and the link swings on."""
    coulomb, speed, duration = 9.0, 0.8, 400 * PERIOD
    flight = GearedFlight(oscillator(GEAR, LINK), SUBSTEPS, coulomb)
    flight.motor_velocities[0], flight.velocities[0] = speed, 0.1

    def derivative(sense: float) -> Any:
        def rate(_: float, y: Array) -> Array:
            spring = GEAR.stiffness * (y[1] - y[0])
            motor = -(spring + coulomb) / MOTOR if sense else 0.0
            return np.array([y[2], y[3] if sense else 0.0, spring / LINK, motor])

        return rate

    def at_rest(_: float, y: Array) -> float:
        return float(y[3])

    at_rest.terminal = True  # type: ignore[attr-defined]
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    start = np.array([0.0, 0.0, 0.1, speed])
    slides = solve_ivp(derivative(1.0), (0.0, duration), start, events=at_rest, **options)
    stops = float(slides.t[-1])
    assert 10 * PERIOD < stops < 0.5 * duration
    stopped = np.array([*slides.y[:3, -1], 0.0])
    stands = solve_ivp(derivative(0.0), (stops, duration), stopped, **options)
    largest = GEAR.stiffness * np.abs(stands.y[1] - stands.y[0]).max()
    assert largest < coulomb, "the spring must not tear it off"
    truth = flight.rest(400)
    assert truth.motor_velocities[0] == 0.0
    actual = [truth.joint_positions[0], truth.motor_positions[0], truth.joint_velocities[0]]
    np.testing.assert_allclose(actual, stands.y[:3, -1], rtol=1e-9, atol=0.0)


def test_a_stuck_joint_is_a_stuck_motor() -> None:
    """The fault raises the motor's friction: it stops at once, and the link swings about it."""
    flight = GearedFlight(oscillator(GEAR, LINK), SUBSTEPS, faults=["stuck_joint@0.05:joint=1000"])
    torque = [0.0, 0.0, 0.0, 4.0]
    flight.fly(torque, 102)
    stopped = flight.plant.truth.motor_positions[0]
    swings = []
    for _ in range(400):
        truth = flight.fly(torque)
        assert truth.motor_positions[0] == stopped
        swings.append(truth.joint_positions[0] - stopped)
    assert stopped > 0.0
    assert min(swings) < -1e-3
    assert max(swings) > 1e-3
