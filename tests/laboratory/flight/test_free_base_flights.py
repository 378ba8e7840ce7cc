"""Flights in which nothing turns the base: a closed form, and what the laws notice.

The arm's motion turns the base by momentum exchange. In the plane the angle is an integral along
the path in joint space, ``theta_0 = -integral of sum H_0i / H_00 dq_i``, however fast it is run
through; over a closed path it is not zero: a cat's turn.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import simulated
from numpy.typing import NDArray
from scipy.integrate import quad, simpson

from space_robot import Robot
from space_robot.analysis import analyze
from space_robot.analysis.attitude_drift import attitude_drift
from space_robot.analysis.metrics import tracking_error
from space_robot_control.laws import laws
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import SingularAttitudeError

Array = NDArray[np.float64]

PERIOD = 5e-4
GAINS = "config/gains/paper/tuned"
CORNERS_DEG = [
    [10.0, 150.0, -20.0, 5.0, 0.0, -15.0],
    [160.0, 150.0, 20.0, 15.0, 60.0, 30.0],
    [150.0, -10.0, 20.0, -45.0, 40.0, 90.0],
    [10.0, 150.0, -20.0, 5.0, 0.0, -15.0],
]
"""A triangle in joint space, back to where it began."""
TIMES = [0.0, 2.5, 5.0, 7.5]
H_BAR = [1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.1, 1.2, 1.2]
"""Two thirds of ``1 / (H_f^-1)_ii`` along the triangle: the largest eigenvalue is below 2."""
REST = 0.25
"""s after the last waypoint."""


def planar_file() -> dict[str, Any]:
    """A robot whose joints all turn about z, heavy beside its base."""
    rng = np.random.default_rng(15)

    def body(mass: float, size: float) -> dict[str, Any]:
        return {"mass": mass, "inertia": [size, size, size * 1.5, 0.0, 0.0, 0.0]}

    links = [
        {
            "name": f"joint{i + 1}",
            "alpha_deg": 0.0,
            "a": float(rng.uniform(0.4, 1.2)),
            "d": 0.0,
            **body(float(rng.uniform(5.0, 30.0)), float(rng.uniform(0.5, 2.0))),
            "com": [float(rng.uniform(0.2, 0.8)), float(rng.uniform(-0.2, 0.2)), 0.0],
        }
        for i in range(6)
    ]
    return {"robot": {"name": "planar", "base": body(120.0, 40.0), "links": links}}


PLANAR = Robot.from_dict(planar_file())


def turning_rate(robot: Robot, q: Array, qdot: Array) -> Array:
    """(...,) rad/s of the base of a planar robot without momentum, in complex numbers.

    With the bodies' angles phi_i and CoMs r_i in the base's frame, sigma_i = r_i - r_CoM:
    ``sum (I_i + m_i |sigma_i|^2) w = -sum I_i phi_idot + m_i Im(conj(sigma_i) sigma_idot)``.
    """
    inertia, mass = robot.inertia[:, 2, 2], robot.mass
    angle = rate = np.zeros(q.shape[:-1])
    place = velocity = np.zeros(q.shape[:-1], complex)
    com, moving, angles = [place], [velocity], [rate]
    for i in range(robot.n):
        along = np.exp(1j * angle)
        place = place + robot.offset[i, 0] * along
        velocity = velocity + 1j * rate * robot.offset[i, 0] * along
        angle, rate = angle + q[..., i], rate + qdot[..., i]
        arm = (robot.com[i + 1, 0] + 1j * robot.com[i + 1, 1]) * np.exp(1j * angle)
        com.append(place + arm)
        moving.append(velocity + 1j * rate * arm)
        angles.append(rate)
    r, v = np.stack(com, axis=-1), np.stack(moving, axis=-1)
    share = mass / mass.sum()
    sigma, drift = r - (r @ share)[..., None], v - (v @ share)[..., None]
    whole = inertia.sum() + np.abs(sigma) ** 2 @ mass
    arms = np.stack(angles, axis=-1) @ inertia + (sigma.conj() * drift).imag @ mass
    return np.asarray(-arms / whole)


def turned_round() -> float:
    """Angle, rad, round the triangle: by quadrature along straight lines in joint space."""
    return sum(
        quad(lambda x, a=a, b=b: turning_rate(PLANAR, a + x * (b - a), b - a), 0.0, 1.0)[0]
        for a, b in pairwise(np.radians(CORNERS_DEG))
    )


def closed_path(folder: Path, law: str) -> FlightLog:
    """The planar robot round the triangle, without friction."""
    path = folder / "planar.yaml"
    path.write_text(yaml.safe_dump(planar_file()))
    mission = {"waypoint_times": TIMES, "waypoints_deg": np.ravel(CORNERS_DEG).tolist()}
    return simulated(
        controller=law,
        robot=str(path),
        mission="paper",
        gains=GAINS,
        friction=False,
        actuators="none",
        duration=TIMES[-1] + REST,
        parameters={
            "mission": mission,
            "plant": {"initial_joints_deg": CORNERS_DEG[0]},
            "controller": {f"{law}.h_bar": H_BAR} if law.startswith("tde") else {},
        },
    )


def base_angle(quaternion: Array) -> Array:
    """(N,) rad about z, without jumps."""
    assert (quaternion[:, 1:3] == 0.0).all()
    return np.unwrap(2.0 * np.arctan2(quaternion[:, 3], quaternion[:, 0]))


@pytest.mark.parametrize(
    ("law", "tolerance"), [("ctc", 1e-7), ("ctc_smc", 1e-4), ("tde_stc", 5e-2), ("indi", 1e-7)]
)
def test_a_closed_path_of_a_planar_arm_turns_the_base_by_the_closed_form(
    tmp_path: Path, law: str, tolerance: float
) -> None:
    """Through the whole loop: at the end the arm is where it was, and the base is not; the base's
    angle to what is left of the joints' tracking errors, rad."""
    expected = turned_round()
    assert expected > np.radians(16.0)
    log = closed_path(tmp_path, law)
    angle = base_angle(log.quaternion)
    assert angle[-1] == pytest.approx(expected, abs=tolerance)
    # along the path as it was flown, without its errors
    rates = turning_rate(PLANAR, log.joint_positions, log.joint_velocities)
    assert angle[-1] == pytest.approx(simpson(rates, dx=PERIOD), abs=1e-7)
    np.testing.assert_allclose(log.omega_base[:, 2], rates, rtol=0, atol=1e-12)
    if law == "ctc":
        np.testing.assert_allclose(log.joint_positions[-1], log.joint_positions[0], atol=1e-13)
        drift = analyze(log)["attitude_drift"]
        assert drift["end_deg"] == pytest.approx(np.degrees(expected), rel=1e-7)


# No attitude is singular


@pytest.mark.parametrize("law", ["ctc", "tde_stc"])
def test_half_a_turn_is_an_attitude_like_any_other(law: str) -> None:
    """There the laws refuse to hold a base; joints of a free one fly as ever."""
    turned = {"plant": {"initial_quaternion": [0.0, 0.0, 0.6, 0.8]}}
    options: dict[str, Any] = {"controller": law, "actuators": "none", "duration": 0.5}
    upright, log = simulated(**options), simulated(**options, parameters=turned)
    errors = [tracking_error(flown)[:, 3:] for flown in (upright, log)]
    np.testing.assert_allclose(errors[1], errors[0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(attitude_drift(log), attitude_drift(upright), rtol=0, atol=1e-9)
    with pytest.raises(SingularAttitudeError):
        simulated(controller=law, duration=0.01, parameters=turned)


@pytest.mark.parametrize("law", sorted(laws()))
def test_the_base_gets_no_torque_and_the_laws_no_error(law: str) -> None:
    """Sensors, faults and a filter between plant and law make no difference to that."""
    log = simulated(
        controller=law,
        actuators="none",
        gains="robust",
        sensors="fine",
        navigation="filtered",
        duration=0.2,
        faults=["torque_scale@0.1:base=1.1"],
        swaps=["0.15:ctc_smc"],
    )
    for values in (log.commanded_torque, log.applied_torque, log.telemetry.swapaxes(0, 1)[:4]):
        assert (values[..., :3] == 0.0).all()
    assert np.isfinite(log.telemetry).all()
    assert analyze(log)["navigation_error"]["rms"].keys() == {"joints_1_3", "joints_4_6"}
