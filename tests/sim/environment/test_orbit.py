"""What acts in orbit: gravity's gradient, light, magnetic field, drag and sunlight on plates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from oracles.orbit import (
    EARTH_RADIUS,
    EARTH_RATE,
    MU,
    body_motions,
    body_places,
    centre_of_mass,
    exact_difference,
    whole_momenta,
)
from robots import MOTORS, NO_FRICTION, coast, orbiting_plant, rigid_robot, set_motion
from scipy.spatial.transform import Rotation
from strategies import random_quaternion, random_robot_file

from space_robot_model.dynamics.algebra import vector as at_0
from space_robot_model.dynamics.model import Data
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.component import Installation
from space_robot_sim.environment.gravity_gradient import add_gravity_gradient
from space_robot_sim.environment.orbit import (
    Orbit,
    OrbitSettings,
    light,
    magnetic_field,
    orbit_layers,
)
from space_robot_sim.plant.plant import Plant

POINT = rigid_robot(2.0, [1.0, 1.0, 1.0])
FIELD = {"strength": 2.98e-5, "tilt_deg": 9.41, "pole_deg": -72.68}


def orbit_of(**groups: Any) -> Orbit:
    """Return the record of settings by group, on a circular orbit at 400 km."""
    elements = {"orbital_elements": {"height": 400e3}}
    return Orbit.build(OrbitSettings.model_validate({**elements, **groups}), Installation(6))


def field(position: ArrayLike, time: float = 0.0, **magnetism: float) -> Array:
    """Return the field (3,) at a place, T."""
    out = np.empty(3)
    magnetic_field(orbit_of(magnetism={**FIELD, **magnetism}), np.array(position), time, out)
    return out


def test_the_field_is_the_dipole_of_the_geomagnetic_reference_field() -> None:
    """Degree one of IGRF-13 in 2020; its radius is 6371.2 km, so that 2.98e-5 T is 0.3 % more.

    ``B = (a / r)^3 (3 (G . u) u - G)``, ``G = (g11, h11, g10)``, Greenwich at right ascension 0.
    """
    coefficients = 1e-9 * np.array([-1450.9, 4652.5, -29404.8])
    rng = np.random.default_rng(13)
    for _ in range(20):
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        distance = EARTH_RADIUS + rng.uniform(300e3, 2e6)
        expected = (6371.2e3 / distance) ** 3 * (3.0 * coefficients @ u * u - coefficients)
        size = np.linalg.norm(expected)
        np.testing.assert_allclose(field(distance * u), expected, rtol=0, atol=4e-3 * size)
        strength = np.linalg.norm(coefficients) * (6371.2e3 / EARTH_RADIUS) ** 3
        exactly = field(distance * u, strength=strength)
        np.testing.assert_allclose(exactly, expected, rtol=0, atol=1e-4 * size)  # digits of degrees


@given(st.floats(0.0, 1e6))
def test_the_field_turns_with_the_earth(time: float) -> None:
    place = np.array([4e6, -3e6, 5e6])
    turn = Rotation.from_euler("z", EARTH_RATE * time)
    np.testing.assert_allclose(
        field(turn.apply(place), time), turn.apply(field(place)), rtol=0, atol=1e-17
    )


def test_the_robot_measures_the_field_on_its_axes_and_its_dipole_feels_it() -> None:
    moment = [0.3, -0.2, 0.5]
    settings = {
        "orbital_elements": {"height": 400e3, "inclination_deg": 60.0, "anomaly_deg": 50.0},
        "initial_quaternion": [0.3, -0.8, 0.4, 0.2],
        "magnetism": {**FIELD, "residual_dipole": moment},
    }
    plant = orbiting_plant(POINT, 0.5, **settings)
    set_motion(plant, omega=[0.01, -0.02, 0.015])
    state = coast(plant, 200)
    turn = Rotation.from_quat(np.roll(state.quaternion, -1))
    expected = field(state.orbit_position, 100.0)
    np.testing.assert_allclose(turn.apply(state.magnetic_field), expected, rtol=0, atol=1e-18)
    np.testing.assert_allclose(
        state.external_torques[9:], np.cross(turn.apply(moment), expected), rtol=0, atol=1e-17
    )


@kernel
def light_at(orbit: Orbit, position: Array) -> float:
    return light(orbit, at_0(position, 0))


@pytest.mark.parametrize("beta", [0.0, 30.0, -50.0])
def test_the_shadow_begins_where_the_earths_cylinder_is(beta: float) -> None:
    """``cos u = -sqrt(1 - (R_E / r)^2) / cos(beta)`` from noon, as a triangle shows."""
    a = EARTH_RADIUS + 700e3
    sunlight = {"pressure": 4.56e-6, "beta_angle_deg": beta, "noon_deg": 25.0}
    orbit, noon = orbit_of(sunlight=sunlight), np.radians(25.0)

    def is_lit(angle: float) -> bool:
        u = noon + angle
        return light_at(orbit, a * np.array([np.cos(u), np.sin(u), 0.0])) == 1.0

    entry = np.arccos(-np.sqrt(1.0 - (EARTH_RADIUS / a) ** 2) / np.cos(np.radians(beta)))
    for side in (1.0, -1.0):
        for angle, expected in ((entry - 1e-9, True), (entry + 1e-9, False), (np.pi, False)):
            assert is_lit(side * angle) is expected
    assert is_lit(0.0)


def test_no_file_is_read_without_an_orbit() -> None:
    """So a resolved scenario flies where there are no files."""
    assert orbit_layers("none") == orbit_layers("given") == []
    assert [path.stem for path in orbit_layers("iss")] == ["iss"]


def test_settings_without_an_orbit_are_refused_by_their_key() -> None:
    OrbitSettings().check_orbit("here")
    with pytest.raises(InputError, match=r"^here: magnetism: without an orbit"):
        OrbitSettings.model_validate({"magnetism": {"strength": 3e-5}}).check_orbit("here")


DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)
HEIGHTS = st.floats(200e3, 4e7)
DISTANCES = st.floats(-3.0, 5.0).map(lambda power: 10.0**power)
FEW = settings(max_examples=200)


def vector(direction: tuple[float, ...], length: float) -> Array:
    """Return a vector (3,) of that length."""
    return np.asarray(length * np.array(direction) / np.linalg.norm(direction))


def difference(r: Array, d: Array, has_j2: bool) -> Array:
    """Return the same by the kernel, as the force on a body without extent over its mass."""
    data = Data.allocate(POINT.n)
    data.first_moment[:], data.inertia[:], data.bias[:] = 0.0, 0.0, 0.0
    add_gravity_gradient(POINT.model, r, d, float(has_j2), data)
    np.testing.assert_array_equal(data.bias[0, :3], np.zeros(3))
    return np.asarray(-data.bias[0, 3:] / POINT.model.mass[0])


@FEW
@given(DIRECTION, HEIGHTS, DIRECTION, DISTANCES, st.booleans())
def test_gravity_difference_loses_no_digits(
    direction: tuple[float, ...],
    height: float,
    aside: tuple[float, ...],
    distance: float,
    has_j2: bool,
) -> None:
    """Between 1 mm and 100 km from the point, relative to ``mu d / r^3``."""
    r, d = vector(direction, EARTH_RADIUS + height), vector(aside, distance)
    size = MU * distance / (EARTH_RADIUS + height) ** 3
    expected = exact_difference(r, d, has_j2)
    np.testing.assert_allclose(difference(r, d, has_j2), expected, rtol=0, atol=1e-14 * size)


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
    plane = (ELEMENTS["raan_deg"], ELEMENTS["inclination_deg"], SUN["noon_deg"])
    beta = np.radians(SUN["beta_angle_deg"])
    turn = Rotation.from_euler("ZXZ", plane, degrees=True)
    return np.asarray(turn.apply([np.cos(beta), 0.0, np.sin(beta)]))


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


def test_momentum_is_what_air_and_light_give() -> None:
    """``F T`` and ``M T`` about the orbit's point, summed over the ticks, of an arm that moves."""
    robot = box_robot(3)
    plant = flying(robot, 3, atmosphere={**AIR, "density": 1e-10}, sunlight=SUN)

    linear, angular = whole_momenta(body_motions(robot, plant.truth))
    impulse, turn = np.zeros(3), np.zeros(3)
    surfaces = plant.memory.environment.surfaces
    for _ in range(200):
        wrench = surfaces.drag + surfaces.sunlight
        # the base moves by velocity times half a tick while the moment about it is held
        middle = plant.truth.base_position + 0.5 * PERIOD * plant.truth.base_velocity
        impulse += PERIOD * wrench[3:]
        turn += PERIOD * (wrench[:3] + np.cross(middle, wrench[3:]))
        coast(plant, 1)
    end, end_angular = whole_momenta(body_motions(robot, plant.truth))
    size = np.linalg.norm(impulse)
    assert size > 1e-2
    np.testing.assert_allclose(end - linear, impulse, rtol=0, atol=1e-8 * size)
    np.testing.assert_allclose(
        end_angular - angular, turn, rtol=0, atol=1e-8 * np.linalg.norm(turn)
    )
