"""Variables of the orbit, of gears, and of plates: what the plant flies with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from robots import DRIVE, PLATES, driven_paper

from space_robot.campaign.draws import Draws
from space_robot.campaign.study import Study
from space_robot_model.orbit.elements import EARTH_RADIUS
from space_robot_model.robot import Robot
from space_robot_model.robot.plates import plates_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant

DRIVEN = Robot.from_dict(driven_paper())
DRAG = slice(3, 6)
"""Of the external torques."""


def draws_of(vary: dict[str, Any], **scenario: Any) -> Draws:
    content = {"scenario": {"duration": 0.02, **scenario}, "laws": ["ctc"], "vary": vary}
    return Draws(Study.model_validate(content), 3, 8)


def plants(draws: Draws, runs: int = 3) -> list[tuple[dict[str, Any], Plant]]:
    """The values of some runs, and the plants at tick 0."""
    return [(draws.values(run), draws.flight(run, "ctc").plant) for run in range(runs)]


def refused(vary: dict[str, Any], **scenario: Any) -> str:
    with pytest.raises(InputError) as error:
        draws_of(vary, **scenario)
    return str(error.value)


def test_an_orbit_varies_as_other_parameters() -> None:
    """Elements, air and light; relative to the orbit of the scenario."""
    draws = draws_of(
        {
            "plant.orbital_elements.height": {"uniform": [400e3, 800e3]},
            "plant.orbital_elements.inclination_deg": {"uniform": [-1, 1], "offset": True},
            "plant.sunlight.beta_angle_deg": {"uniform": [-60, 60]},
            "plant.atmosphere.density": {"log_uniform": [0.3, 3.0], "relative": True},
        },
        orbit="iss",
    )
    for values, plant in plants(draws):
        orbit = plant.memory.environment.orbit
        height = values["plant.orbital_elements.height"]
        semi_major_axis = EARTH_RADIUS + height
        # of the vis-viva integral
        speed, distance = np.linalg.norm(orbit.velocity), np.linalg.norm(orbit.position)
        assert 1.0 / (2.0 / distance - speed**2 / 3.986004418e14) == pytest.approx(
            semi_major_axis, rel=1e-12
        )
        normal = np.cross(orbit.position, orbit.velocity)
        normal /= np.linalg.norm(normal)
        inclination = 51.64 + values["plant.orbital_elements.inclination_deg"]
        assert np.degrees(np.arccos(normal[2])) == pytest.approx(inclination, rel=1e-9)
        beta = np.degrees(np.arcsin(normal @ orbit.sun))
        assert beta == pytest.approx(values["plant.sunlight.beta_angle_deg"], abs=1e-9)
        assert orbit.density == 3.725e-12 * values["plant.atmosphere.density"]


def test_a_height_alone_makes_an_orbit() -> None:
    for values, plant in plants(
        draws_of({"plant.orbital_elements.height": {"choice": [4e5, 5e5]}})
    ):
        radius = EARTH_RADIUS + values["plant.orbital_elements.height"]
        assert np.linalg.norm(plant.truth.orbit_position) == pytest.approx(radius, rel=1e-12)


def test_orbits_are_drawn_by_name() -> None:
    draws = draws_of({"scenario.orbit": {"grid": ["none", "iss"]}})
    assert [plant.names.in_orbit for _, plant in plants(draws, 2)] == [False, True]


def test_gears_vary_joint_by_joint() -> None:
    """``*`` is every joint with a gear."""
    vary = {
        "robot.joints[*].drive.stiffness": {"uniform": [0.5, 2.0], "relative": True},
        "robot.joints[joint3].drive.damping": {"uniform": [-100.0, 100.0], "offset": True},
        "robot.joints[5].drive.gear_ratio": {"uniform": [90.0, 110.0]},
        "robot.joints[2].drive.rotor_inertia": {"normal": 1.0, "sigma": 0.05, "relative": True},
    }
    draws = draws_of(vary, robot=DRIVEN)
    stiff = [f"robot.joints[joint{k}].drive.stiffness" for k in (2, 3, 5)]
    assert draws.names[:3] == stiff
    for values, plant in plants(draws):
        gears = dict(zip((2, 3, 5), filter(None, plant.robot.gears), strict=True))
        for name, gear in zip(stiff, gears.values(), strict=True):
            assert gear.stiffness == DRIVE["stiffness"] * values[name]
        assert gears[3].damping == DRIVE["damping"] + values["robot.joints[joint3].drive.damping"]
        assert gears[5].ratio == values["robot.joints[joint5].drive.gear_ratio"]
        factor = values["robot.joints[joint2].drive.rotor_inertia"]
        assert gears[2].rotor_inertia == DRIVE["rotor_inertia"] * factor
        row = int(plant.memory.model.row[1])
        assert plant.memory.model.rotor_inertia[row] == gears[2].rotor_inertia
    assert draws.flight(0, "ctc").scenario.robots.controller.gears == DRIVEN.gears


def test_plates_vary_together_or_one_by_one() -> None:
    """Drag is proportional to area and coefficient."""
    scenario = {"robot": DRIVEN, "orbit": "iss"}
    vary = {
        "robot.plates.area": {"uniform": [0.5, 2.0], "relative": True},
        "robot.plates.drag_coefficient": {"uniform": [1.8, 2.6]},
        "robot.plates[3].specular": {"uniform": [-0.1, 0.1], "offset": True},
        "robot.plates[*].diffuse": {"uniform": [0.0, 0.2]},
    }
    ((_, nominal),) = plants(draws_of({"plant.hold_ticks": 200}, **scenario), 1)
    assert np.linalg.norm(nominal.truth.external_torques[DRAG]) > 1e-6
    for values, plant in plants(draws_of(vary, **scenario)):
        area, coefficient = (values[f"robot.plates.{key}"] for key in ("area", "drag_coefficient"))
        plates = plant.robot.plates
        assert [p.area for p in plates] == [own["area"] * area for own in PLATES]
        assert [p.diffuse for p in plates] == [
            values[f"robot.plates[{k + 1}].diffuse"] for k in range(3)
        ]
        assert plates[2].specular == 0.6 + values["robot.plates[3].specular"]
        assert plant.truth.external_torques[DRAG] == pytest.approx(
            nominal.truth.external_torques[DRAG] * area * coefficient / 2.2, rel=1e-12
        )


def test_plates_of_shapes_stay_where_they_are() -> None:
    """With another centre of mass of the base, air presses on the same surfaces."""
    vary = {
        "robot.base.com[*]": {"uniform": [-0.1, 0.1], "offset": True},
        "robot.base.inertia": {"scale": 0.1},
        "robot.links[*].mass": {"uniform": [0.9, 1.1], "relative": True},
    }
    draws = draws_of(vary, orbit="iss")
    nominal = draws.nominal("ctc").check().robot
    for values, plant in plants(draws, 2):
        shift = np.array([values[f"robot.base.com[{axis}]"] for axis in "xyz"])
        for own, plate in zip(plates_of(nominal), plant.robot.plates, strict=True):
            expected = own.centre - shift * (own.body == 0)
            np.testing.assert_allclose(plate.centre, expected, atol=1e-15)
            assert (plate.area, plate.body) == (own.area, own.body)


@pytest.mark.parametrize(
    ("vary", "scenario", "said"),
    [
        (
            {"plant.orbital_elements.eccentricity": {"uniform": [0, 0.5]}},
            {"orbit": "iss"},
            "eccentricity can be 0.5: plant parameters: orbital_elements: the perigee must be",
        ),
        (
            {"plant.atmosphere.density": {"uniform": [0, 1e-12]}},
            {},
            "plant parameters: atmosphere: without an orbit it has no effect",
        ),
        ({"plant.orbit": "iss"}, {}, "orbit applies to the whole flight: use scenario.orbit"),
        ({"robot.joints[*].drive.stiffness": 1e5}, {}, "no joint of robot 'paper' has a gear"),
        (
            {"robot.joints[joint1].drive.stiffness": 1e5},
            {"robot": DRIVEN},
            "joint joint1 has no gear; joints with gears: joint2, joint3, joint5",
        ),
        (
            {"robot.joints[2].drive.stiffness": {"log_uniform": [1e4, 1e11]}},
            {"robot": DRIVEN},
            "drive.stiffness of 'joint2' is too large for steps of 0.0005 s",
        ),
        (
            {"robot.joints[2].drive.rotor_inertia": {"uniform": [0.01, 2.0]}},
            {"robot": DRIVEN},
            "the inertia of 'joint1' must be larger than that of the rotors on it",
        ),
        (
            {"robot.joints[2].drive.gear_ratio": {"uniform": [-1, 1]}},
            {"robot": DRIVEN},
            "can be -1: must be 1 or more",
        ),
        ({"robot.joints[2].drive.encoder": "link"}, {"robot": DRIVEN}, "'drive.encoder': choose"),
        ({"robot.joints[2].drive.stiffness[1]": 1e5}, {"robot": DRIVEN}, "has no elements"),
        ({"robot.plates[9].area": 1.0}, {"robot": DRIVEN}, "no plate '9'"),
        ({"robot.plates[1].colour": 1.0}, {"robot": DRIVEN}, "choose one of area, drag_coeff"),
        ({"robot.plates.area[1]": 1.0}, {"robot": DRIVEN}, "area has no elements"),
        (
            {"robot.plates.specular": {"uniform": [0.5, 0.9]}},
            {"robot": DRIVEN},
            "specular can be 0.9: plate 1: specular 0.9 and diffuse 0.3 are shares of the same",
        ),
    ],
)
def test_what_cannot_be_varied(vary: dict[str, Any], scenario: dict[str, Any], said: str) -> None:
    error = refused(vary, **scenario)
    assert error.startswith(f"campaign: vary.{next(iter(vary))}")
    assert said in error
