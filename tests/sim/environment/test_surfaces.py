"""Drag and sunlight on plates, against formulas written out here, and the momentum they give."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from orbiting_robots import (
    EARTH_RADIUS,
    EARTH_RATE,
    LOCKED,
    MOTORS,
    NO_FRICTION,
    angular_momentum,
    body_motions,
    body_places,
    centre_of_mass,
    coast,
    orbiting_plant,
    rigid_robot,
    set_motion,
)
from random_robots import random_quaternion, random_robot_file

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.plant.plant import Plant

Array = NDArray[np.float64]

PERIOD = 0.1
NO_GRAVITY = {"gradient": False, "j2": False}
ELEMENTS = {"height": 400e3, "inclination_deg": 51.6, "raan_deg": 20.0, "anomaly_deg": 33.0}
DENSITY, PRESSURE = 3e-12, 4.56e-6
AIR = {"density": DENSITY, "at_height": 400e3, "scale_height": 58.5e3}
SUN = {"pressure": PRESSURE, "beta_angle_deg": 30.0, "noon_deg": 40.0}


def plates_of_box(edges: tuple[float, float, float], link: str, **shares: float) -> list[Any]:
    """Return the six sides of a box at a link's origin, as a robot's file has them."""
    sides = []
    for axis in range(3):
        area = edges[axis - 1] * edges[axis - 2]
        for side in (1.0, -1.0):
            normal = [0.0] * 3
            normal[axis] = side
            centre = [0.5 * edges[axis] * x + 0.1 for x in normal]
            sides.append({"link": link, "area": area, "normal": normal, "centre": centre, **shares})
    return sides


def box_robot(seed: int, **shares: float) -> Robot:
    """Return an arm of six joints whose base and links are boxes."""
    rng = np.random.default_rng(seed)
    content = random_robot_file(rng, MOTORS)
    names = ["base", *(f"joint{k + 1}" for k in range(MOTORS))]
    content["robot"]["plates"] = [
        plate
        for name in names
        for plate in plates_of_box(tuple(rng.uniform(0.1, 2.0, 3)), name, **shares)
    ]
    return Robot.from_dict(content)


def flying(robot: Robot, seed: int, **options: Any) -> Plant:
    """Return a plant in any posture and motion, the boxes in wind and light."""
    rng = np.random.default_rng(seed)
    usual = {"orbital_elements": ELEMENTS, "gravity": NO_GRAVITY, "friction": NO_FRICTION}
    plant = orbiting_plant(
        robot,
        PERIOD,
        initial_quaternion=random_quaternion(rng).tolist(),
        initial_joints_deg=rng.uniform(-180.0, 180.0, robot.n).tolist(),
        **{**usual, **options},
    )
    omega, rates = 0.01 * rng.normal(size=3), 0.01 * rng.normal(size=robot.n)
    set_motion(plant, 10.0 * rng.normal(size=3), rng.normal(size=3), omega, rates)
    return plant


def wind_of(state: RobotState) -> Array:
    """Return the velocity of the base against the air, m/s."""
    place = state.orbit_position + state.base_position
    return np.asarray(
        state.orbit_velocity + state.base_velocity - np.cross([0.0, 0.0, EARTH_RATE], place)
    )


def density_of(state: RobotState) -> float:
    """Return the density of `AIR`, kg/m3."""
    height = np.linalg.norm(state.orbit_position + state.base_position) - EARTH_RADIUS
    return float(DENSITY * np.exp(-(height - 400e3) / 58.5e3))


def sun() -> Array:
    """Return the direction of the Sun of `SUN`, by rotation matrices."""
    raan, inclination = np.radians([ELEMENTS["raan_deg"], ELEMENTS["inclination_deg"]])
    noon, beta = np.radians([SUN["noon_deg"], SUN["beta_angle_deg"]])
    node = np.array([np.cos(raan), np.sin(raan), 0.0])
    normal = np.array(
        [
            np.sin(raan) * np.sin(inclination),
            -np.cos(raan) * np.sin(inclination),
            np.cos(inclination),
        ]
    )
    in_plane = np.cos(noon) * node + np.sin(noon) * np.cross(normal, node)
    return np.asarray(np.cos(beta) * in_plane + np.sin(beta) * normal)


def wrenches(robot: Robot, state: RobotState) -> tuple[Array, Array, Array, Array]:
    """Return force and moment about the orbit's point of drag, then of sunlight."""
    v, s = wind_of(state), sun()
    speed = float(np.linalg.norm(v))
    u = v / speed
    drag, light = np.zeros((2, 3)), np.zeros((2, 3))
    places = body_places(robot, state)
    for plate in robot.plates:
        axes, origin = places[plate.body]
        n, at = axes @ plate.normal, origin + axes @ plate.centre
        if n @ u > 0.0:
            pull = 0.5 * density_of(state) * speed**2 * plate.drag_coefficient * plate.area
            force = -pull * (n @ u) * u
            drag += force, np.cross(at, force)
        cosine = n @ s
        if cosine > 0.0:
            absorbed = 1.0 - plate.specular - plate.diffuse
            force = absorbed * -s  # what comes is kept
            force += plate.specular * -2.0 * cosine * n  # it is turned back at the same angle
            force += plate.diffuse * -(s + 2.0 / 3.0 * n)  # it goes out as from a Lambert surface
            force *= PRESSURE * plate.area * cosine
            light += force, np.cross(at, force)
    return drag[0], drag[1], light[0], light[1]


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.5)]))
def test_wrenches_on_boxes_agree_with_the_formulas(seed: int, shares: tuple[float, float]) -> None:
    """Of any posture; absorbed, specular and diffuse light, and between them."""
    specular, diffuse = shares
    robot = box_robot(seed, specular=specular, diffuse=diffuse, drag_coefficient=2.1)
    plant = flying(robot, seed, atmosphere=AIR, sunlight=SUN)
    state, surfaces = plant.truth, plant.memory.environment.surfaces
    drag, drag_moment, light, light_moment = wrenches(robot, state)
    for wrench, force, moment in (
        (surfaces.drag, drag, drag_moment),
        (surfaces.sunlight, light, light_moment),
    ):
        size = np.linalg.norm(force)
        assert size > 1e-6
        about_base = moment - np.cross(state.base_position, force)
        np.testing.assert_allclose(wrench[3:], force, rtol=0, atol=1e-11 * size)
        np.testing.assert_allclose(wrench[:3], about_base, rtol=0, atol=1e-10 * size)
    com = centre_of_mass(robot, state)
    reported = state.external_torques.reshape(4, 3)
    for torque, force, moment in (
        (reported[1], drag, drag_moment),
        (reported[2], light, light_moment),
    ):
        size = np.linalg.norm(force)
        np.testing.assert_allclose(torque, moment - np.cross(com, force), rtol=0, atol=1e-10 * size)


def test_closed_forms_of_a_plate_that_faces_wind_or_sun() -> None:
    """``1/2 rho v^2 C_d A``; of light P A absorbed, 2 P A reflected, 5/3 P A diffuse."""
    area = 3.0
    for specular, diffuse, share in ((0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (0.0, 1.0, 5.0 / 3.0)):
        plate = {"area": area, "normal": sun().tolist(), "drag_coefficient": 2.0}
        robot = rigid_robot(
            10.0, [1.0] * 3, plates=[{**plate, "specular": specular, "diffuse": diffuse}]
        )
        plant = orbiting_plant(robot, PERIOD, orbital_elements=ELEMENTS, sunlight=SUN)
        light = plant.memory.environment.surfaces.sunlight[3:]
        np.testing.assert_allclose(light, -share * PRESSURE * area * sun(), rtol=1e-13)
    plant = orbiting_plant(robot, PERIOD, orbital_elements=ELEMENTS)
    wind = wind_of(plant.truth)
    plate["normal"] = wind.tolist()
    robot = rigid_robot(10.0, [1.0] * 3, plates=[plate])
    plant = orbiting_plant(robot, PERIOD, orbital_elements=ELEMENTS, atmosphere=AIR)
    expected = -0.5 * density_of(plant.truth) * np.linalg.norm(wind) * wind * 2.0 * area
    np.testing.assert_allclose(plant.memory.environment.surfaces.drag[3:], expected, rtol=1e-12)


def test_momentum_is_what_air_and_light_give() -> None:
    """``F T`` and ``M T`` about the orbit's point, summed over the ticks, of an arm that moves."""
    robot = box_robot(3)
    plant = flying(robot, 3, atmosphere={**AIR, "density": 1e-10}, sunlight=SUN)

    def momenta() -> tuple[Array, Array]:
        bodies = body_motions(robot, plant.truth)
        linear = sum(body.mass * body.velocity for body in bodies)
        angular = sum(
            body.spin + body.mass * np.cross(body.position, body.velocity) for body in bodies
        )
        return np.asarray(linear), np.asarray(angular)

    linear, angular = momenta()
    impulse, turn = np.zeros(3), np.zeros(3)
    surfaces = plant.memory.environment.surfaces
    for _ in range(200):
        wrench = surfaces.drag + surfaces.sunlight
        # the base moves by velocity times half a tick while the moment about it is held
        middle = plant.truth.base_position + 0.5 * PERIOD * plant.truth.base_velocity
        impulse += PERIOD * wrench[3:]
        turn += PERIOD * (wrench[:3] + np.cross(middle, wrench[3:]))
        coast(plant, 1)
    end, end_angular = momenta()
    size = np.linalg.norm(impulse)
    assert size > 1e-2
    np.testing.assert_allclose(end - linear, impulse, rtol=0, atol=1e-8 * size)
    np.testing.assert_allclose(
        end_angular - angular, turn, rtol=0, atol=1e-8 * np.linalg.norm(turn)
    )


def test_the_step_with_air_and_light_is_of_first_order_in_the_tick() -> None:
    """They are held over a tick, so that half the tick halves the error of the angular momentum."""
    robot = box_robot(5)
    ends = []
    for halves in range(4):
        usual = {"orbital_elements": ELEMENTS, "gravity": NO_GRAVITY, "friction": LOCKED}
        plant = orbiting_plant(
            robot, 4.0 / 2**halves, **usual, atmosphere={**AIR, "density": 1e-9}, sunlight=SUN
        )
        set_motion(plant, omega=[0.002, -0.003, 0.001])
        ends.append(angular_momentum(robot, coast(plant, 50 * 2**halves)))
    changes = [float(np.linalg.norm(b - a)) for a, b in pairwise(ends)]
    assert changes[0] / changes[1] == pytest.approx(2.0, rel=0.2)
    assert changes[1] / changes[2] == pytest.approx(2.0, rel=0.2)
