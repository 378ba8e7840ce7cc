"""N_hat of (35), (36) with the inertia of the nominal model, and the gains that choose it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from closed_loop import PERIOD
from hypothesis import assume, given, settings
from law_equations import random_gains
from oracles import (
    attitude_jacobian_inertial,
    pinocchio_forward_dynamics,
    rho_space_inertia,
    rotation_of,
    skew,
)
from strategies import Case, cases

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import NOMINAL_H_BAR, read_gains
from space_robot_control.controller.loop import LawSet
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import ControlLaw, find_law, laws
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.samples import Reference, RobotState

WITH_H_BAR = sorted(name for name, law in laws().items() if "h_bar" in law.gain_descriptions())
FREE = BaseActuatorSettings(base_actuation="none")


def nominal_law(name: str, axes: int, **changes: Array) -> ControlLaw:
    """A law whose estimate has the nominal inertia, with random gains."""
    law = find_law(name)
    gains = random_gains(law, axes, seed=1)
    if "h_bar" in gains:
        gains["h_bar"] = np.zeros(axes)
    return law({**gains, **changes}, PERIOD)


def measured(case: Case, tick: int, rate: tuple[Any, Any], torque: Array) -> RobotState:
    """A state of the case's attitude and posture with another velocity."""
    state = RobotState.allocate(case.robot.n)
    state.tick, state.quaternion[:] = tick, case.state.quaternion
    state.omega_base[:] = rotation_of(case.state.quaternion).inv().apply(rate[0])
    state.joint_positions[:], state.joint_velocities[:] = case.state.theta, rate[1]
    state.applied_torque[:] = torque
    return state


def error_of(case: Case) -> Array:
    """q_e where the identity is desired: the first one has eta >= 0."""
    return case.state.quaternion * np.copysign(1.0, case.state.quaternion[0])


def flown_into(case: Case, law: ControlLaw, controls_base: bool) -> tuple[Controller, Array, Array]:
    """A controller that has seen an interval with the acceleration that Pinocchio gives for a
    torque on the nominal robot; the force F_S, and rhodd."""
    robot, s, rng = case
    torque = 10.0 * rng.normal(size=robot.n + 3)
    if not controls_base:
        torque[:3] = 0.0
    rotation = rotation_of(s.quaternion)
    force = np.concatenate([np.zeros(3), rotation.apply(torque[:3]), torque[3:]])
    acceleration = pinocchio_forward_dynamics(robot, s, force)[3:]
    error = error_of(case)
    j0 = attitude_jacobian_inertial(error)
    epsilon_rate, eta_rate = j0 @ s.w0, -0.5 * error[1:] @ s.w0
    rhodd = acceleration.copy()
    rhodd[:3] = j0 @ acceleration[:3]
    rhodd[:3] += 0.5 * (eta_rate * np.eye(3) - skew(epsilon_rate)) @ s.w0
    # one posture at both ticks, so that the difference of rhodot is rhodd and nothing else
    before = np.linalg.solve(j0, epsilon_rate - PERIOD * rhodd[:3]), s.rate - PERIOD * rhodd[3:]
    actuators = None if controls_base else FREE
    controller = Controller(robot, law, PERIOD, actuators=actuators)
    reference = Reference.at_rest(robot.n)
    controller.update(measured(case, 7, before, torque), reference)
    controller.update(measured(case, 8, (s.w0, s.rate), torque), reference)
    applied = torque.copy()
    applied[:3] = np.linalg.solve(j0.T, rotation.apply(torque[:3]))
    return controller, applied, rhodd


@pytest.mark.parametrize(
    ("name", "controls_base"), [("tde_stc", True), ("indi", True), ("indi", False)]
)
@settings(max_examples=15)
@given(case=cases(joints=[1, 6]))
def test_it_is_the_force_that_the_nominal_inertia_does_not_explain(
    name: str, controls_base: bool, case: Case
) -> None:
    """``F_S(t - d) - H_S rhodd(t - d)``, H_S by Pinocchio; and with a perfect model it is c_S: of
    the joints alone where nothing turns the base."""
    assume(abs(case.state.quaternion[0]) > 0.1)
    law = nominal_law(name, case.robot.n + 3)
    controller, force, rhodd = flown_into(case, law, controls_base)
    signals = controller.signals
    inertia = rho_space_inertia(case.robot, error_of(case), case.state.theta)
    size = np.abs(inertia).max() * (1.0 + np.abs(rhodd).max()) + np.abs(force).max()
    np.testing.assert_allclose(signals.n_hat, signals.nominal.bias, rtol=0.0, atol=1e-11 * size)
    if controls_base:
        unexplained = force - inertia @ rhodd
        np.testing.assert_allclose(signals.n_hat, unexplained, rtol=0.0, atol=1e-11 * size)
    else:
        assert (signals.n_hat[:3] == 0.0).all()
        assert (signals.paired_force[3:] == force[3:]).all()


@pytest.mark.parametrize("name", WITH_H_BAR)
@settings(max_examples=10)
@given(case=cases(joints=[6]))
def test_the_controller_adds_the_inertia_times_u(name: str, case: Case) -> None:
    """``F_S = H_S u + ...`` where a constant one has ``h_bar u``; u itself is the same. The force
    is not added to that of the last tick."""
    assume(abs(case.state.quaternion[0]) > 0.1)
    law = nominal_law(name, case.robot.n + 3)
    controller = flown_into(case, law, True)[0]
    memory, signals = controller.block[0], controller.signals
    inertia = rho_space_inertia(case.robot, error_of(case), case.state.theta)
    s, u = law.memory.s, law.memory.u
    switching = law.gains.g * np.sign(s) if name == "tde_smc" else np.zeros(9)
    own = memory.force - memory.transfer * (memory.transfer_left + 1.0) / memory.transfer_ticks
    size = np.abs(inertia).max() * (1.0 + np.abs(u).max()) + np.abs(memory.transfer).max()
    wanted = inertia @ u + signals.n_hat + switching
    np.testing.assert_allclose(own, wanted, rtol=0.0, atol=1e-10 * size)


# Gains


def test_a_gains_file_says_nominal(tmp_path: Path) -> None:
    """As a word, or in a list; recorded and told as zeros, which are the same."""
    for h_bar in (NOMINAL_H_BAR, [NOMINAL_H_BAR], [0.0], [0.0] * 9):
        path = tmp_path / "tde_smc.yaml"
        content = {"h_bar": h_bar, "lambda": [1.0], "g": [0.1]}
        path.write_text(
            yaml.safe_dump({"controller_node": {"ros__parameters": {"tde_smc": content}}})
        )
        gains = read_gains(path, find_law("tde_smc"), 9)
        np.testing.assert_array_equal(gains["h_bar"], np.zeros(9))
        law = find_law("tde_smc")(gains, PERIOD)
        assert law.needs_model
        assert law.in_force(3).gains["h_bar"] == (0.0,) * 9


def test_a_parameter_does_not_change_the_kind_of_estimate(domain: int) -> None:
    """The compiled code is that of one of the two; a value of the same kind is taken."""
    rclpy = pytest.importorskip("rclpy")
    from rclpy.parameter import Parameter

    def parameter(name: str, value: list[float]) -> Any:
        return Parameter(f"{name}.h_bar", value=value)

    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = rclpy.create_node(
        "laws", context=context, parameter_overrides=[parameter("tde_smc", [0.0])]
    )
    node.declare_parameter("controller", "tde_stc")
    laws_of_node = LawSet(node, ControllerNodeSettings.resolve({"controller": "tde_stc"}), 9)
    by_name = {law.name: law for law in laws_of_node.laws}
    assert (by_name["tde_stc"].needs_model, by_name["tde_smc"].needs_model) == (False, True)
    for name, value, said in (
        ("tde_stc", [2.0], ""),
        ("tde_smc", [0.0] * 9, ""),
        ("tde_stc", [0.0], "tde_stc.h_bar cannot be changed from a constant to nominal"),
        ("tde_smc", [1.0], "tde_smc.h_bar cannot be changed from nominal to a constant"),
        ("tde_smc", [0.0] * 8 + [1.0], "tde_smc.h_bar: finite values above 0 (or nominal"),
    ):
        (result,) = node.set_parameters([parameter(name, value)])
        assert result.successful is not bool(said)
        assert said in result.reason
        assert "\n" not in result.reason
    np.testing.assert_array_equal(by_name["tde_stc"].h_bar, np.full(9, 2.0))
    np.testing.assert_array_equal(by_name["tde_smc"].h_bar, np.zeros(9))
    node.destroy_node()
    context.try_shutdown()
