"""Basilisk: a rigid hub with effectors of gravity gradient, and of facets in air and light."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from Basilisk.architecture import bskLogging, messaging
from Basilisk.simulation import (
    GravityGradientEffector,
    eclipse,
    exponentialAtmosphere,
    facetDragDynamicEffector,
    facetSRPDynamicEffector,
    spacecraft,
    svIntegrators,
    zeroWindModel,
)
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, simIncludeGravBody
from numpy.typing import NDArray
from oracles import quaternion_of, rotation_of
from oracles.orbit import EARTH_RADIUS, EARTH_RATE, MU
from scipy.spatial.transform import Rotation

from .orbiting import ORBIT, SOURCES, Moment, Orbiting, OurSatellite

Array = NDArray[np.float64]

ASTRONOMICAL_UNIT = 149597870700.0
"""m."""

bskLogging.setDefaultLogLevel(bskLogging.BSK_WARNING)


class BasiliskSatellite:
    """Hub, effectors and environment in one task, integrated by RK4."""

    name = "basilisk"

    def __init__(self, start: Orbiting, body: OurSatellite, with_wind: bool = True) -> None:
        """Build the same satellite.

        Args:
            start: how it turns at first, and what acts on it.
            body: its inertia, facets and orbit.
            with_wind: whether the air turns with the Earth, which the effector's default does not.
        """
        simulation = self._simulation = SimulationBaseClass.SimBaseClass()
        self._period_ns = round(start.period * 1e9)
        process = simulation.CreateNewProcess("process")
        process.addTask(simulation.CreateNewTask("task", self._period_ns))
        hub = self._hub = _hub(start, body)
        factory = simIncludeGravBody.gravBodyFactory()
        earth = factory.createEarth()
        earth.isCentralBody, earth.mu = True, MU
        factory.addBodiesTo(hub)
        place = messaging.SpicePlanetStateMsgPayload()
        place.PlanetName = "custom"
        self._earth = messaging.SpicePlanetStateMsg().write(place)
        self._effectors: dict[str, Any] = {}
        modules: list[Any] = []
        if "gravity gradient" in start.sources:
            gradient = GravityGradientEffector.GravityGradientEffector()
            gradient.addPlanetName(earth.planetName)
            self._effectors["gravity gradient"] = gradient
        if "drag" in start.sources:
            modules += self._drag(body, with_wind)
        self._eclipse: eclipse.Eclipse | None = None
        if "sunlight" in start.sources:
            modules += self._sunlight(start, body)
        for name, effector in self._effectors.items():
            effector.ModelTag = name
            hub.addDynamicEffector(effector)
        self._integrator = svIntegrators.svIntegratorRK4(hub)
        hub.setIntegrator(self._integrator)
        for module in (*modules, *self._effectors.values(), hub):
            simulation.AddModelToTask("task", module)
        simulation.InitializeSimulation()
        simulation.ConfigureStopTime(0)
        simulation.ExecuteSimulation()
        self._steps = 0

    def _drag(self, body: OurSatellite, with_wind: bool) -> list[Any]:
        """Add the effector; return the modules it reads from."""
        air, atmosphere = ORBIT["atmosphere"], exponentialAtmosphere.ExponentialAtmosphere()
        atmosphere.planetRadius, atmosphere.scaleHeight = EARTH_RADIUS, air["scale_height"]
        atmosphere.baseDensity = air["density"] * math.exp(air["at_height"] / air["scale_height"])
        atmosphere.addSpacecraftToModel(self._hub.scStateOutMsg)
        drag = facetDragDynamicEffector.FacetDragDynamicEffector()
        for facet in body.facets:
            drag.addFacet(
                facet.area, facet.drag_coefficient, facet.normal.tolist(), facet.centre.tolist()
            )
        drag.atmoDensInMsg.subscribeTo(atmosphere.envOutMsgs[0])
        self._effectors["drag"] = drag
        if not with_wind:
            return [atmosphere]
        wind = zeroWindModel.ZeroWindModel()
        wind.planetPosInMsg.subscribeTo(self._earth)
        wind.setPlanetOmega_N([0.0, 0.0, EARTH_RATE])
        wind.addSpacecraftToModel(self._hub.scStateOutMsg)
        drag.windVelInMsg.subscribeTo(wind.envOutMsgs[0])
        return [atmosphere, wind]

    def _sunlight(self, start: Orbiting, body: OurSatellite) -> list[Any]:
        """Add the effector; return the modules it reads from."""
        place = messaging.SpicePlanetStateMsgPayload()
        place.PositionVector = (ASTRONOMICAL_UNIT * start.sun).tolist()
        self._sun = messaging.SpicePlanetStateMsg().write(place)
        shadow = self._eclipse = eclipse.Eclipse()
        shadow.rEqCustom = EARTH_RADIUS
        shadow.sunInMsg.subscribeTo(self._sun)
        shadow.addSpacecraftToModel(self._hub.scStateOutMsg)
        shadow.addPlanetToModel(self._earth)
        light = facetSRPDynamicEffector.FacetSRPDynamicEffector()
        light.setNumFacets(len(body.facets))
        light.setNumArticulatedFacets(0)
        for facet in body.facets:
            light.addFacet(
                facet.area,
                np.eye(3),
                facet.normal.tolist(),
                [0.0, 0.0, 1.0],
                facet.centre.tolist(),
                facet.diffuse,
                facet.specular,
            )
        light.sunInMsg.subscribeTo(self._sun)
        light.sunEclipseInMsg.subscribeTo(shadow.eclipseOutMsgs[0])
        self._effectors["sunlight"] = light
        return [shadow]

    def fly(self, steps: int) -> Moment:
        """Fly on so many steps."""
        self._steps += steps
        self._simulation.ConfigureStopTime(self._steps * self._period_ns)
        self._simulation.ExecuteSimulation()
        hub = self._hub.scStateOutMsg.read()
        rotation = Rotation.from_matrix(RigidBodyKinematics.MRP2C(hub.sigma_BN).T)
        torques = np.zeros((3, 3))
        for row, name in enumerate(SOURCES):
            if effector := self._effectors.get(name):
                effector.computeForceTorque(0.0, 0.0)  # of this state, not of the last stage's
                torques[row] = rotation.apply(np.ravel(effector.torqueExternalPntB_B))
        return Moment(quaternion_of(rotation), torques, self._light)

    @property
    def _light(self) -> float:
        if self._eclipse is None:
            return 1.0
        message = self._eclipse.eclipseOutMsgs[0].read()
        names = ("illuminationFactor", "shadowFactor")  # the new one, and that up to 2.12
        return float(next(getattr(message, name) for name in names if hasattr(message, name)))


def _hub(start: Orbiting, body: OurSatellite) -> spacecraft.Spacecraft:
    hub = spacecraft.Spacecraft()
    hub.ModelTag = "satellite"
    hub.hub.mHub = body.mass
    hub.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    hub.hub.IHubPntBc_B = body.inertia.tolist()
    hub.hub.r_CN_NInit = body.position[:, np.newaxis].tolist()
    hub.hub.v_CN_NInit = body.velocity[:, np.newaxis].tolist()
    rotation = rotation_of(start.quaternion)
    hub.hub.sigma_BNInit = rotation.as_mrp()[:, np.newaxis].tolist()
    hub.hub.omega_BN_BInit = rotation.inv().apply(start.omega)[:, np.newaxis].tolist()
    return hub
