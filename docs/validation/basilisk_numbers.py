"""A satellite in orbit by Basilisk, for the table of docs/validation.md.

    python3 -m venv .venv-bench && .venv-bench/bin/pip install bsk
    .venv-bench/bin/python docs/validation/basilisk_numbers.py

Writes basilisk.json beside this file: settings, random states, and what Basilisk makes of them.
A venv of its own, since `bsk` holds matplotlib back; nothing of this project is imported.
"""

from __future__ import annotations

import json
import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.simulation import (
    GravityGradientEffector,
    exponentialAtmosphere,
    facetDragDynamicEffector,
    facetSRPDynamicEffector,
    gravityEffector,
    magneticFieldCenteredDipole,
    spacecraft,
    sphericalHarmonicsGravityModel,
)
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass

MU, RADIUS, J2, EARTH_RATE = 3.986004418e14, 6378137.0, 1.08262668e-3, 7.292115e-5
"""m3/s2, m, -, rad/s."""
AU = 149597870.7e3
"""m: the Sun's distance, at which Basilisk's sunlight is 1368 W/m2."""
SETTINGS: dict[str, Any] = {
    "mass": 80.0,
    "principal": [6.0, 5.0, 4.0],
    "duration": 5600.0,
    "step": 0.5,
    "air": {"density": 3e-9, "at_height": 0.0, "scale_height": 58.5e3},
    "pressure": 1368.0 / 299792458.0,
    "dipole": [-1450.9e-9, 4652.5e-9, -29404.8e-9],  # g11, h11, g10 of IGRF-13 in 2020, T
    "plates": [  # area, drag coefficient, specular, diffuse, normal, centre
        [1.2, 2.1, 0.3, 0.2, [1.0, 0.0, 0.0], [0.6, 0.1, 0.0]],
        [1.2, 2.1, 0.3, 0.2, [-1.0, 0.0, 0.0], [-0.5, 0.1, 0.0]],
        [0.7, 2.3, 0.0, 0.5, [0.0, 0.6, 0.8], [0.1, 0.4, 0.3]],
        [0.4, 2.2, 0.9, 0.0, [0.0, -0.8, 0.6], [0.0, -0.4, 0.7]],
    ],
}


def random_state(rng: np.random.Generator) -> dict[str, Any]:
    """Return the satellite's motion at a height of some 400 km, lit by the Sun."""
    axes, attitude = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=4)
    distance, aside = RADIUS + rng.uniform(380e3, 600e3), rng.normal(size=3)
    sun = axes[0] + 0.5 * aside / np.linalg.norm(aside)
    state = {
        "position": distance * axes[0],
        "velocity": math.sqrt(MU / distance) * axes[1],
        "quaternion": attitude / np.linalg.norm(attitude),
        "omega": 0.01 * rng.normal(size=3),
        "sun": sun / np.linalg.norm(sun),
    }
    return {name: vector.tolist() for name, vector in state.items()}


def started(state: dict[str, Any], has_j2: bool) -> tuple[Any, Any]:
    """Return a simulation, and the satellite in it."""
    base, step = SimulationBaseClass.SimBaseClass(), round(SETTINGS["step"] * 1e9)
    base.CreateNewProcess("process").addTask(base.CreateNewTask("task", step))
    body, earth = spacecraft.Spacecraft(), gravityEffector.GravBodyData()
    body.hub.mHub, body.hub.IHubPntBc_B = SETTINGS["mass"], np.diag(SETTINGS["principal"]).tolist()
    body.hub.r_CN_NInit, body.hub.v_CN_NInit = state["position"], state["velocity"]
    body.hub.sigma_BNInit = RigidBodyKinematics.EP2MRP(state["quaternion"])
    body.hub.omega_BN_BInit = state["omega"]
    earth.planetName, earth.mu, earth.radEquator, earth.isCentralBody = "earth", MU, RADIUS, True
    if has_j2:
        model = sphericalHarmonicsGravityModel.SphericalHarmonicsGravityModel()
        model.muBody, model.radEquator, model.maxDeg = MU, RADIUS, 2
        model.cBar = [[1.0], [0.0, 0.0], [-J2 / math.sqrt(5.0), 0.0, 0.0]]
        model.sBar = [[0.0], [0.0, 0.0], [0.0, 0.0, 0.0]]
        earth.gravityModel = model
    body.gravField.gravBodies = spacecraft.GravBodyVector([earth])
    base.AddModelToTask("task", body)
    base.kept = earth
    return base, body


def run(base: Any, duration: float) -> None:
    """Integrate by Basilisk's RK4."""
    base.InitializeSimulation()
    base.ConfigureStopTime(round(duration * 1e9))
    base.ExecuteSimulation()


def orbit(state: dict[str, Any], has_j2: bool) -> dict[str, Any]:
    """Fly an orbit with J2, or with the gravity gradient; return position and axes at its end."""
    base, body = started(state, has_j2)
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName("earth")
    if not has_j2:
        body.addDynamicEffector(gradient)
        base.AddModelToTask("task", gradient)
    run(base, SETTINGS["duration"])
    end = body.scStateOutMsg.read()
    return {"position": end.r_BN_N, "axes": RigidBodyKinematics.MRP2C(end.sigma_BN).T.tolist()}


def acting(state: dict[str, Any]) -> dict[str, Any]:
    """Return force and torque of drag and sunlight on the body's axes, and the magnetic field."""
    base, body = started(state, False)
    wind, sun = messaging.WindMsgPayload(), messaging.SpicePlanetStateMsgPayload()
    wind.v_air_N = np.cross([0.0, 0.0, EARTH_RATE], state["position"]).tolist()
    sun.PositionVector = (np.array(state["position"]) + AU * np.array(state["sun"])).tolist()
    messages = messaging.WindMsg().write(wind), messaging.SpicePlanetStateMsg().write(sun)
    air = exponentialAtmosphere.ExponentialAtmosphere()
    air.planetRadius, air.baseDensity = RADIUS, SETTINGS["air"]["density"]
    air.scaleHeight = SETTINGS["air"]["scale_height"]
    field = magneticFieldCenteredDipole.MagneticFieldCenteredDipole()
    field.planetRadius, (field.g11, field.h11, field.g10) = RADIUS, SETTINGS["dipole"]
    drag = facetDragDynamicEffector.FacetDragDynamicEffector()
    light = facetSRPDynamicEffector.FacetSRPDynamicEffector()
    light.setNumFacets(len(SETTINGS["plates"]))
    for area, coefficient, specular, diffuse, normal, centre in SETTINGS["plates"]:
        drag.addFacet(area, coefficient, normal, centre)
        light.addFacet(area, np.eye(3), normal, [0.0, 0.0, 1.0], centre, diffuse, specular)
    for module in (air, field, drag, light):
        base.AddModelToTask("task", module)
    for module in (air, field):
        module.addSpacecraftToModel(body.scStateOutMsg)
    drag.atmoDensInMsg.subscribeTo(air.envOutMsgs[0])
    drag.windVelInMsg.subscribeTo(messages[0])
    light.sunInMsg.subscribeTo(messages[1])
    result = {}
    for effector in (drag, light):
        body.addDynamicEffector(effector)
    run(base, 0.0)
    for name, effector in (("drag", drag), ("sunlight", light)):
        effector.computeForceTorque(0.0, 0.0)
        wrench = effector.forceExternal_B, effector.torqueExternalPntB_B
        result[name] = np.reshape(wrench, (2, 3)).tolist()
    return {**result, "field": field.envOutMsgs[0].read().magField_N}


def main() -> None:
    """Run the command."""
    rng = np.random.default_rng(1)
    states = [random_state(rng) for _ in range(50)]
    numbers = {"version": version("bsk"), "settings": SETTINGS, "states": states}
    numbers |= {"j2": orbit(states[0], True), "gradient": orbit(states[0], False)}
    numbers["acting"] = [acting(state) for state in states]
    file = Path(__file__).with_name("basilisk.json")
    file.write_text(json.dumps(numbers) + "\n", "utf-8")


if __name__ == "__main__":
    main()
