"""A controller whose base has wheels, thrusters and torquers: what it commands, holds, tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_loop import PERIOD, law_of

from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.supervisor import Mode, Supervisor
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Reference, RobotState

CORNERS = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
WHEELS: dict[str, Any] = {
    "axes": CORNERS,
    "rotor_inertia": [0.05],
    "max_torque": [50.0],
    "max_momentum": [100.0],
}
POSITIONS, DIRECTIONS = np.zeros((2, 12, 3))
for axis in range(3):
    for row, (arm, side) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        POSITIONS[4 * axis + row, (axis + 1) % 3] = arm
        DIRECTIONS[4 * axis + row, (axis + 2) % 3] = side
THRUSTERS: dict[str, Any] = {
    "positions": POSITIONS.ravel().tolist(),
    "directions": DIRECTIONS.ravel().tolist(),
    "force": [10.0],
    "shortest_pulse": [0.01],
}


TORQUERS: dict[str, Any] = {"axes": np.eye(3).ravel().tolist(), "max_dipole": [400.0]}
FIELD = np.array([1e-5, -2e-5, 3e-5])
"""T, base axes."""


def controller_of(robot: Robot, law: str = "ctc", **hardware: Any) -> Controller:
    actuators = BaseActuatorSettings(base_actuation="hardware", **hardware)
    return Controller(
        robot,
        law_of(law),
        PERIOD,
        actuators=actuators,
        allocation=AllocationSettings(failure_ticks=20, modulation="sigma_delta"),
    )


def state_at(tick: int) -> RobotState:
    """Off the reference, so that the base is asked for a torque."""
    state = RobotState.allocate(6)
    state.tick = tick
    state.quaternion[:] = [1.0, 1e-6, -1e-6, 1e-6]
    return state


REST = Reference.at_rest(6)


def test_wheels_are_asked_for_the_torque_of_the_base(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS)
    ideal = Controller(paper_robot, law_of("ctc"), PERIOD).update(state_at(0), REST).torque
    command = controller.update(state_at(0), REST)
    np.testing.assert_array_equal(command.torque[:9], ideal)
    axes = np.reshape(CORNERS, (4, 3)) / np.sqrt(3.0)
    assert np.abs(ideal[:3]).max() > 1.0
    np.testing.assert_allclose(-command.torque[9:] @ axes, ideal[:3], atol=1e-9)
    assert controller.names.commanded[9:] == ("wheel_1", "wheel_2", "wheel_3", "wheel_4")


def test_thrusters_are_open_or_closed(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, thrusters=THRUSTERS)
    forces = np.array([controller.update(state_at(k), REST).torque[9:] for k in range(100)])
    assert set(forces.ravel()) == {0.0, 10.0}


def test_while_it_holds_its_torque_the_valves_are_closed(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS, thrusters=THRUSTERS)
    supervisor = Supervisor(controller, hold_ticks=5)
    good = supervisor.answer(state_at(0), REST).torque
    good[controller.valves] = 10.0
    wheels = good[9:13].copy()
    bad = state_at(1)
    bad.wheel_velocities[2] = np.nan
    held = supervisor.answer(bad, REST)
    assert supervisor.mode is Mode.HOLDING
    np.testing.assert_array_equal(held.torque[9:13], wheels)
    assert held.torque[13:].size == 12
    assert not held.torque[13:].any()
    for tick in range(2, 8):
        bad.tick = tick
        held = supervisor.answer(bad, REST)
    assert supervisor.mode is Mode.SAFE
    assert not held.torque.any()


def with_torquers(tick: int) -> RobotState:
    """Return a state in a magnetic field, whose wheels store a momentum."""
    state = state_at(tick)
    state.wheel_velocities[:4] = [10.0, 20.0, -5.0, 40.0]
    state.magnetic_field[:] = FIELD
    return state


def test_torquers_and_wheels_are_asked_for_the_torque_of_the_base(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS, magnetic_torquers=TORQUERS)
    ideal = Controller(paper_robot, law_of("ctc"), PERIOD).update(with_torquers(0), REST).torque
    command = controller.update(with_torquers(0), REST)
    assert controller.names.commanded[13:] == ("torquer_1", "torquer_2", "torquer_3")
    np.testing.assert_array_equal(command.torque[:9], ideal)
    axes = np.reshape(CORNERS, (4, 3)) / np.sqrt(3.0)
    momentum = 0.05 * np.array([10.0, 20.0, -5.0, 40.0]) @ axes
    dipoles = command.torque[13:]
    expected = 0.002 * np.cross(momentum, FIELD) / (FIELD @ FIELD)
    np.testing.assert_allclose(dipoles, expected, rtol=1e-12)
    torque = np.cross(dipoles, FIELD) - command.torque[9:13] @ axes
    np.testing.assert_allclose(torque, ideal[:3], atol=1e-9)
    assert controller.allocation.values["largest_dipole"] == np.abs(dipoles).max()


def test_without_a_law_the_field_is_read_too(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS, magnetic_torquers=TORQUERS)
    by_law = controller.update(with_torquers(0), REST).torque[13:].copy()
    other = controller_of(paper_robot, wheels=WHEELS, magnetic_torquers=TORQUERS)
    command = other.allocate_torque(with_torquers(0), np.zeros(9))
    np.testing.assert_array_equal(command.torque[13:], by_law)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -1e31])
def test_while_the_magnetometer_is_wrong_no_dipole_is_commanded(
    paper_robot: Robot, wrong: float
) -> None:
    """The torque of the wheels is held, then all are switched off."""
    controller = controller_of(paper_robot, wheels=WHEELS, magnetic_torquers=TORQUERS)
    supervisor = Supervisor(controller, hold_ticks=5)
    wheels = supervisor.answer(with_torquers(0), REST).torque[9:13].copy()
    for tick in range(1, 8):
        bad = with_torquers(tick)
        bad.magnetic_field[1] = wrong
        held = supervisor.answer(bad, REST)
        assert not held.torque[13:].any()
        assert supervisor.mode is (Mode.HOLDING if tick < 6 else Mode.SAFE)
        np.testing.assert_array_equal(held.torque[9:13], wheels if tick < 6 else np.zeros(4))
    assert supervisor.answer(with_torquers(8), REST).torque[13:].all()


def test_failed_wheels_are_told(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS)
    assert controller.allocation.summary == ""
    for dead in ((1,), (1, 2)):
        asked = np.zeros(4)
        first = 100 * len(dead)
        for tick in range(first, first + 40):
            state = state_at(tick)
            state.wheel_torques[:4] = asked
            state.wheel_torques[list(dead)] = 0.0
            asked = controller.update(state, REST).torque[9:].copy()
        found = controller.allocation
        assert found.failed == tuple(f"wheel_{k + 1}" for k in dead)
        assert found.values["failed"] == ", ".join(found.failed)
    assert found.values["wheel_axes"] == 2
    assert "wheels turn 2 of 3 axes, the base is not controlled fully" in found.summary


def test_full_wheels_pulses_and_unloading_are_told(paper_robot: Robot) -> None:
    controller = controller_of(paper_robot, wheels=WHEELS, thrusters=THRUSTERS)
    for tick in range(100):
        state = state_at(tick)
        state.wheel_velocities[:4] = [1600.0, -1600.0, 1600.0, 1600.0]
        controller.update(state, REST)
    values = controller.allocation.values
    assert values["fullest_wheel"] == pytest.approx(0.8)
    assert values["unloading"] == "yes"
    assert values["pulses"] > 0


def test_ideal_base_has_nothing_to_tell(paper_robot: Robot) -> None:
    assert Controller(paper_robot, law_of("ctc"), PERIOD).allocation.values == {}
