"""Whole flights of plant and controller: what the laws achieve, late or disturbed or swapped."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from closed_loop import H_BAR, PERIOD, Loop, law_of
from numpy.typing import NDArray
from paths import CONFIG

from space_robot import Robot
from space_robot_control.laws import ControlLaw, LawGains, Signals, find_law, per_axis
from space_robot_msgs_py.errors import FlightError
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.payload import PayloadSettings

Array = NDArray[np.float64]


def test_super_twisting_holds_errors_below_a_millionth(paper_robot: Robot) -> None:
    """TDE-STC, printed gains, case 1: two seconds into the mission."""
    errors, torques = Loop(paper_robot, law_of("tde_stc")).fly(4000)
    assert np.abs(errors).max() < 1e-6
    assert np.abs(torques).max() < 5.0


@pytest.mark.parametrize(("latency", "bound"), [(1, 1e-6), (2, 2e-6), (4, 5e-6)])
def test_late_commands_do_no_harm(paper_robot: Robot, latency: int, bound: float) -> None:
    """The estimate is fed with the torque that the plant reports as applied.

    Errors grow with the estimate's age, by joints breaking away from rest; see the next test.
    """
    errors, _ = Loop(paper_robot, law_of("tde_stc"), command_latency_ticks=latency).fly(4000)
    assert np.abs(errors).max() < bound


def test_pairing_with_its_own_last_output_would_lose_the_arm(paper_robot: Robot) -> None:
    """Why the echo matters: one tick late, the same loop without it is off by a radian."""
    loop = Loop(paper_robot, law_of("tde_stc"), command_latency_ticks=1)
    loop.own_output_as_applied = True
    try:
        errors, _ = loop.fly(4000)
    except FlightError:
        return
    assert np.abs(errors).max() > 0.1


def test_heaviest_case_is_tracked_too(paper_robot: Robot) -> None:
    """Case 4-2: k = 3 and 20 kg on a 5 kg link, all unknown to the controller."""
    payload = PayloadSettings(mass=20.0, inertia=[1.8, 1.0, 1.6, 0.0, 0.0, 0.0])
    disturbance = DisturbanceSettings(scale=3.0)
    loop = Loop(paper_robot, law_of("tde_stc"), payload=payload, disturbance=disturbance)
    errors, _ = loop.fly(2000)
    assert np.abs(errors).max() < 5e-6


def test_seven_joints_fly_with_their_own_gains(seven_joint_robot: Robot) -> None:
    """Nothing assumes six."""
    text = (CONFIG / "gains/seven_joint/tuned/tde_stc.yaml").read_text()
    printed = yaml.safe_load(text)["controller_node"]["ros__parameters"]["tde_stc"]
    gains = {key: np.resize(np.array(value), 10) for key, value in printed.items()}
    mission = yaml.safe_load((CONFIG / "missions/seven_joint.yaml").read_text())
    degrees = mission["mission_node"]["ros__parameters"]["waypoints_deg"]
    errors, _ = Loop(seven_joint_robot, find_law("tde_stc")(gains, PERIOD), degrees).fly(2000)
    assert np.abs(errors).max() < 1e-4


def test_law_can_be_swapped_in_flight(paper_robot: Robot) -> None:
    """Half a second each; every new law starts with a pair that fits."""
    loop = Loop(paper_robot, law_of("tde_stc"))
    for name in ("tde_stc", "tde_smc", "tde_tsmc", "ctc", "tde_stc"):
        loop.controller.law = law_of(name)
        errors, torques = loop.fly(1000)
        assert loop.controller.law.name == name
        assert np.abs(errors).max() < 2e-5
        assert np.abs(torques).max() < 5.0


def test_swapping_in_a_used_law_resets_it(paper_robot: Robot) -> None:
    law = law_of("tde_tsmc")
    loop = Loop(paper_robot, law)
    loop.fly(50)
    assert law.memory.s.any()
    loop.controller.law = law
    np.testing.assert_array_equal(law.memory.s, np.zeros(9))


def test_computed_torque_brings_the_base_back_from_a_large_turn(paper_robot: Robot) -> None:
    """120 degrees about a diagonal: e decays as (1 + 100 t) exp(-100 t), as K_P, K_D say."""
    start = [0.5, -0.5, 0.5, 0.5]
    loop = Loop(
        paper_robot,
        law_of("ctc"),
        friction=FrictionSettings(coulomb=0.0, viscous=0.0),
        initial_quaternion=start,
    )
    errors, _ = loop.fly(400)
    time = np.arange(400)[:, np.newaxis] * PERIOD
    expected = errors[0, :3] * (1.0 + 100.0 * time) * np.exp(-100.0 * time)
    np.testing.assert_allclose(errors[:, :3], expected, atol=0.02)  # zero-order hold: 5 %
    np.testing.assert_allclose(errors[-1], np.zeros(9), atol=1e-5)


class EchoGains(LawGains):
    h_bar: Array = per_axis("constant inertia", "kg m2")


class EchoLaw(ControlLaw):
    """Keeps the acceleration there is: F_S = N_hat + h_bar rhodd_d."""

    name = "echo"
    gains_type = EchoGains

    def force(self, signals: Signals) -> Array:
        return signals.n_hat + self.gains.h_bar * signals.acceleration_desired


def test_a_law_of_ones_own_flies(paper_robot: Robot) -> None:
    """Named ``module:Class``, given its N_hat for its ``h_bar``; without feedback it drifts."""
    law = find_law(f"{__name__}:EchoLaw")({"h_bar": np.array(H_BAR)}, PERIOD)
    errors, _ = Loop(paper_robot, law).fly(1000)
    assert np.abs(errors).max() < 1e-4
