"""Bad files of orbits, drives and plates: one line with file and key, and exit code 2."""

from __future__ import annotations

import copy
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml
from command import Run
from paths import CONFIG, DATA

from space_robot_model.robot.plate_file import MOST_PLATES
from space_robot_sim.environment import surfaces
from space_robot_sim.plant.gear_mounting import MOST_SUBSTEPS
from space_robot_sim.plant.plant import PlantSettings

PAPER = yaml.safe_load((CONFIG / "robots" / "paper.yaml").read_text())
HEIGHT = {"height": 400e3}
IN_ORBIT = {"orbital_elements": HEIGHT}
DRIVE = {"rotor_inertia": 1e-4, "gear_ratio": 100.0, "stiffness": 1e4}
PLATE = {"area": 1.0, "normal": [1.0, 0.0, 0.0], "centre": [0.5, 0.0, 0.0]}
NAN, INFINITE = float("nan"), float("inf")
ONE_FILE = "orbit.yaml"
SHIPPED = ", ".join(sorted(file.stem for file in (CONFIG / "orbits").glob("*.yaml")))


class Bad(NamedTuple):
    """What is wrong in a file, and what is said about it."""

    content: Any
    """Of the file, or of the part of it that the test is about."""
    key: str
    said: str


def _elements(**own: Any) -> dict[str, Any]:
    return {"orbital_elements": {**HEIGHT, **own}}


def _section(name: str, **own: Any) -> dict[str, Any]:
    return {**IN_ORBIT, name: own}


ORBITS = {
    # the elements
    "perigee in the Earth": Bad(
        _elements(eccentricity=0.1), "orbital_elements", "must be below 0.059"
    ),
    "parabola": Bad(_elements(eccentricity=1.0), "eccentricity", "less than 1, got 1.0"),
    "eccentricity below 0": Bad(_elements(eccentricity=-0.1), "eccentricity", "equal to 0"),
    "height below 0": Bad(_elements(height=-1.0), "orbital_elements.height", "got -1.0"),
    "height beyond the Moon": Bad(_elements(height=1e12), "height", "equal to 1000000000,"),
    "height as text": Bad(_elements(height="low"), "height", "a valid number, got 'low'"),
    "height as list": Bad(_elements(height=[4e5]), "height", "a valid number, got [4"),
    "height true": Bad(_elements(height=True), "height", "a valid number, got True"),
    "height without value": Bad(_elements(height=None), "height", "a valid number, got None"),
    "height not a number": Bad(_elements(height=NAN), "height", "a finite number, got nan"),
    "height infinite": Bad(_elements(height=INFINITE), "height", "a finite number, got inf"),
    "inclination": Bad(_elements(inclination_deg=181.0), "inclination_deg", "equal to 180"),
    "node": Bad(_elements(raan_deg=400.0), "raan_deg", "equal to 360"),
    "misspelt element": Bad(
        _elements(inclination=50.0), "orbital_elements.inclination", "did you mean inclination_deg?"
    ),
    "unknown element": Bad(_elements(period=5400.0), "orbital_elements.period", "unknown key"),
    "elements as number": Bad(
        {"orbital_elements": 4e5}, "orbital_elements", "a mapping was expected, got 400000.0"
    ),
    # what is met there
    "density below 0": Bad(_section("atmosphere", density=-1.0), "atmosphere.density", "got -1.0"),
    "scale height 0": Bad(_section("atmosphere", scale_height=0.0), "scale_height", "1000, got"),
    "pressure below 0": Bad(_section("sunlight", pressure=-1e-6), "pressure", "equal to 0"),
    "beta angle": Bad(_section("sunlight", beta_angle_deg=91.0), "beta_angle_deg", "equal to 90"),
    "unknown light": Bad(
        _section("sunlight", beta=3.0), "sunlight.beta", "did you mean beta_angle_deg?"
    ),
    "strength below 0": Bad(_section("magnetism", strength=-1.0), "strength", "equal to 0"),
    "dipole of two numbers": Bad(
        _section("magnetism", residual_dipole=[1.0, 2.0]), "residual_dipole", "at least 3 items"
    ),
    "dipole as number": Bad(
        _section("magnetism", residual_dipole=2.0), "residual_dipole", "a valid list, got 2.0"
    ),
    "dipole not a number": Bad(
        _section("magnetism", residual_dipole=[0.0, NAN, 0.0]), "residual_dipole.1", "finite number"
    ),
    "gradient as text": Bad(_section("gravity", gradient="yes"), "gradient", "a valid boolean"),
    "oblateness as number": Bad(_section("gravity", j2=1), "gravity.j2", "a valid boolean, got 1"),
    # without an orbit
    "air at height 0": Bad(
        {"orbital_elements": {"height": 0.0}, "atmosphere": {"density": 1e-12}},
        "atmosphere",
        "set orbital_elements.height, which is 0",
    ),
    "sunlight without elements": Bad(
        {"sunlight": {"pressure": 4.56e-6}}, "sunlight", "without an orbit it has no effect"
    ),
    "eccentricity without height": Bad(
        {"orbital_elements": {"eccentricity": 0.1}}, "orbital_elements", "height, which is 0"
    ),
    # what is not of an orbit
    "unknown section": Bad({**IN_ORBIT, "moon": 1}, "moon", "choose one of atmosphere, gravity"),
    "of another file": Bad({"friction": {"coulomb": 1.0}}, "friction", "choose one of atmosphere"),
    "of another node": Bad(
        "controller_node: {ros__parameters: {orbital_elements: {height: 4.0e5}}}",
        "controller_node",
        "of plant_node, and of no other node",
    ),
    "without node": Bad(
        "orbital_elements: {height: 4.0e5}",
        "orbital_elements",
        "it belongs into plant_node: {ros__parameters: {orbital_elements: ...}}",
    ),
    "without ros__parameters": Bad(
        "plant_node: {orbital_elements: {height: 4.0e5}}", "plant_node", "'ros__parameters' was"
    ),
    "not YAML": Bad("plant_node: }", "line 1", "not YAML"),
    "key twice": Bad("plant_node: 1\nplant_node: 2", "line 2", "the key 'plant_node' occurs twice"),
    "a list": Bad("- 1", "", "a mapping was expected, got list"),
    "empty": Bad("", "", "a mapping was expected, got NoneType"),
}
DRIVES = {
    "rotor inertia 0": Bad({"rotor_inertia": 0.0}, "rotor_inertia", "greater than 0, got 0.0"),
    "no rotor inertia": Bad({"rotor_inertia": ...}, "rotor_inertia", "Field required"),
    "gear ratio 0": Bad({"gear_ratio": 0.0}, "gear_ratio", "equal to 0.001, got 0.0"),
    "gear ratio below 0": Bad({"gear_ratio": -100.0}, "gear_ratio", "equal to 0.001, got -100.0"),
    "stiffness below 0": Bad({"stiffness": -1.0}, "stiffness", "greater than 0, got -1.0"),
    "no stiffness": Bad({"stiffness": ...}, "stiffness", "Field required"),
    "infinite stiffness": Bad({"stiffness": INFINITE}, "stiffness", "a finite number, got inf"),
    "damping below 0": Bad({"damping": -1.0}, "damping", "equal to 0, got -1.0"),
    "unknown encoder": Bad({"encoder": "resolver"}, "encoder", "'motor', 'link' or 'both', got"),
    "unknown key": Bad({"ratio": 100.0}, "ratio", "did you mean gear_ratio?"),
}
PLATES = {
    "area 0": Bad({"area": 0.0}, "area", "greater than 0, got 0.0"),
    "no area": Bad({"area": ...}, "area", "Field required"),
    "normal 0": Bad({"normal": [0, 0, 0]}, "normal", "must not be zero"),
    "normal of two numbers": Bad({"normal": [1, 0]}, "normal", "at least 3 items"),
    "no normal": Bad({"normal": ...}, "normal", "Field required"),
    "centre of four numbers": Bad({"centre": [0, 0, 0, 0]}, "centre", "at most 3 items"),
    "centre not a number": Bad({"centre": [0, NAN, 0]}, "centre.1", "a finite number, got nan"),
    "drag below 0": Bad({"drag_coefficient": -1.0}, "drag_coefficient", "equal to 0, got -1.0"),
    "more than a mirror": Bad({"specular": 1.5}, "specular", "less than or equal to 1"),
    "more light than comes": Bad({"specular": 0.7, "diffuse": 0.7}, "", "at most 1, it is 1.4"),
    "unknown key": Bad({"colour": "red"}, "colour", "choose one of area, centre, diffuse"),
}


def _complete(base: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    """``base`` with some keys changed; those that become ``...`` are left out."""
    return {key: value for key, value in {**base, **change}.items() if value is not ...}


def _said(run: Run, file: str, key: str, *words: object) -> str:
    """The line that a flight ends in, which names file and key."""
    ran = run("simulate", *words, "--duration", "0.001")
    assert ran.code == 2
    assert ran.out == ""
    head = f"space-robot: error: {file}: {key}"
    assert ran.err.startswith(head), ran.err
    assert ran.err.count("\n") == 1
    assert len(ran.err) < 400
    return ran.err


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("bad", ORBITS.values(), ids=ORBITS)
def test_bad_orbit(bad: Bad, here: Path, space_robot: Run) -> None:
    content = bad.content
    if not isinstance(content, str):
        content = yaml.safe_dump({"plant_node": {"ros__parameters": content}})
    (here / ONE_FILE).write_text(content)
    said = _said(space_robot, ONE_FILE, "", "--orbit", ONE_FILE)
    assert f"{bad.key}: " in said or not bad.key
    assert bad.said in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--orbit", "leo"], f"unknown orbit 'leo': choose one of {SHIPPED}, or a path"),
        (["--orbit", "nowhere.yaml"], "nowhere.yaml: no such file"),
        (["--set", "plant.atmosphere.density=1e-12"], "plant parameters: atmosphere: without an"),
        (
            ["--orbit", "iss", "--set", "plant.orbital_elements.eccentricity=0.2"],
            "plant parameters: orbital_elements: the perigee must be outside the Earth",
        ),
    ],
)
def test_orbit_that_is_not_there(words: list[str], said: str, here: Path, space_robot: Run) -> None:
    ran = space_robot("simulate", *words, "--duration", "0.001")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert said in ran.err


def _robot_file(folder: Path, change: Callable[[dict[str, Any]], object]) -> str:
    """Write the paper's robot with a change; its name is that of its mission and gains."""
    content = copy.deepcopy(PAPER)
    change(content["robot"])
    (folder / "paper.yaml").write_text(yaml.safe_dump(content))
    return "paper.yaml"


@pytest.mark.parametrize("bad", DRIVES.values(), ids=DRIVES)
def test_bad_drive(bad: Bad, here: Path, space_robot: Run) -> None:
    drive = _complete(DRIVE, bad.content)
    file = _robot_file(here, lambda robot: robot["links"][1].update(drive=drive))
    said = _said(space_robot, file, f"robot.links.1.drive.{bad.key}: ", "--robot", file)
    assert bad.said in said


@pytest.mark.parametrize("bad", PLATES.values(), ids=PLATES)
def test_bad_plate(bad: Bad, here: Path, space_robot: Run) -> None:
    plate = _complete(PLATE, bad.content)
    file = _robot_file(here, lambda robot: robot.update(plates=[PLATE, plate]))
    key = f"robot.plates.1{'.' if bad.key else ''}{bad.key}: "
    assert bad.said in _said(space_robot, file, key, "--robot", file)


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        (
            lambda robot: robot["links"][5].update(
                drive=DRIVE, passive={"stiffness": 1.0, "damping": 0.0}
            ),
            "robot.links.5.drive: ",
            "'joint6' is passive, only a motor can have a drive",
        ),
        (
            lambda robot: robot["links"][5].update(drive=DRIVE, joint="fixed"),
            "robot.links.5.drive: ",
            "a fixed link cannot have",
        ),
        (lambda robot: robot["links"][1].update(drive=100.0), "robot.links.1.drive: ", "a mapping"),
        (lambda robot: robot["base"].update(drive=DRIVE), "robot.base.drive: ", "unknown key"),
        (
            lambda robot: robot["links"][1].update(drive={**DRIVE, "rotor_inertia": 5.0}),
            "drive.rotor_inertia of joint2: ",
            "the inertia of 'joint1' must be larger than that of the rotors on it",
        ),
        (
            lambda robot: robot["links"][1].update(drive={**DRIVE, "damping": 1e6}),
            "drive.damping of 'joint2' is too large",
            "stable up to 2.61 rad in a step; substeps: 194 would do",
        ),
        (
            lambda robot: robot["links"][1].update(drive={**DRIVE, "stiffness": 1e12}),
            "drive.stiffness of 'joint2' is too large",
            "substeps: 193 would do",
        ),
        (
            lambda robot: robot["links"][1].update(
                drive={**DRIVE, "stiffness": 1e12, "rotor_inertia": 1e-8}
            ),
            "drive.stiffness of 'joint2' is too large",
            "not even substeps: 1000 would do",
        ),
        (
            lambda robot: robot.update(plates=[{**PLATE, "link": "hull"}]),
            "robot.plates: ",
            "unknown link 'hull' of plate 0: choose one of base, joint1, joint2",
        ),
        (
            lambda robot: robot.update(plates=[PLATE] * (MOST_PLATES + 1)),
            "robot.plates: ",
            "at most 128 items",
        ),
        (lambda robot: robot.update(plates=PLATE), "robot.plates: ", "a valid list"),
        (lambda robot: robot.update(plates=[1.0]), "robot.plates.0: ", "a mapping was expected"),
    ],
)
def test_bad_robot(
    change: Callable[[dict[str, Any]], object], key: str, said: str, here: Path, space_robot: Run
) -> None:
    file = _robot_file(here, change)
    assert said in _said(space_robot, file, key, "--robot", file)


def test_the_steps_that_an_error_names_would_do(here: Path, space_robot: Run) -> None:
    """So does the period; one substep less would not."""
    drive = {**DRIVE, "stiffness": 1e9}
    file = _robot_file(here, lambda robot: robot["links"][1].update(drive=drive))
    key = "drive.stiffness of 'joint2' is too large for steps of "
    said = _said(space_robot, file, f"{key}0.0005 s: ", "--robot", file)
    advice = said.partition("; substeps: ")[2].split()
    substeps, period = int(advice[0]), float(advice[5])
    words = ["--robot", file, "--set", f"plant.substeps={substeps - 1}"]
    _said(space_robot, file, key, *words)
    for better in (["--set", f"plant.substeps={substeps}"], ["--period", str(period)]):
        ran = space_robot("simulate", "--robot", file, *better, "--duration", "0.001")
        assert ran.code == 0, ran.err


@pytest.mark.parametrize(
    ("more", "key", "said"),
    [
        (
            {"drives": {"elbow": DRIVE}},
            "robot.drives: ",
            "'elbow' is not a joint of the URDF: choose one of shoulder, slide",
        ),
        (
            {"drives": {"wrist": DRIVE}},
            "robot.drives: ",
            "'wrist' is a joint without a motor: choose one of shoulder, slide",
        ),
        (
            {"drives": {"slide": DRIVE}, "passive": {"slide": {"stiffness": 1.0, "damping": 0.0}}},
            "robot.drives: ",
            "'slide' is a joint without a motor",
        ),
        ({"drives": [DRIVE]}, "robot.drives: ", "a valid dictionary"),
        (
            {"drives": {"slide": {**DRIVE, "stiffness": -1.0}}},
            "robot.drives.slide.stiffness: ",
            "greater than 0",
        ),
        (
            {"plates": [PLATE, {**PLATE, "link": "wing"}]},
            "robot.plates.1.link: ",
            "no link 'wing': choose one of hull, upper, fore, hand",
        ),
        ({"plates": [{**PLATE, "area": -1.0}]}, "robot.plates.0.area: ", "greater than 0"),
    ],
)
def test_bad_additions_to_a_urdf(
    more: dict[str, Any], key: str, said: str, here: Path, space_robot: Run
) -> None:
    shutil.copy(DATA / "arm.urdf", here)
    (here / "arm.yaml").write_text(yaml.safe_dump({"robot": {"urdf": "arm.urdf", **more}}))
    words = ["--robot", "arm.yaml", "--mission", "boom"]
    assert said in _said(space_robot, "arm.yaml", key, *words)


def test_limits_are_those_of_the_plant() -> None:
    assert MOST_PLATES == surfaces.MOST_PLATES
    assert {MOST_SUBSTEPS} == {
        bound.le
        for bound in PlantSettings.model_fields["substeps"].metadata
        if hasattr(bound, "le")
    }
