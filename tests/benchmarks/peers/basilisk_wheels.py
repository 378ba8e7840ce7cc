"""Basilisk: `reactionWheelStateEffector` with balanced wheels on a rigid hub."""

from __future__ import annotations

import numpy as np
from Basilisk.architecture import bskLogging, messaging
from Basilisk.simulation import reactionWheelStateEffector, spacecraft, svIntegrators
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, simIncludeRW
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .gyrostat import HELD_STEPS, PERIOD, Gyrostat

Array = NDArray[np.float64]

bskLogging.setDefaultLogLevel(bskLogging.BSK_WARNING)


class BasiliskGyrostat:
    """Hub and wheels in one task of 0.5 ms, integrated by RK4."""

    name = "basilisk"

    def __init__(self, start: Gyrostat) -> None:
        simulation = self._simulation = SimulationBaseClass.SimBaseClass()
        self._period_ns = round(PERIOD * 1e9)
        process = simulation.CreateNewProcess("process")
        process.addTask(simulation.CreateNewTask("task", self._period_ns))
        hub = self._hub = spacecraft.Spacecraft()
        hub.ModelTag = "base"
        hub.hub.mHub = float(start.robot.mass.sum())
        hub.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
        hub.hub.IHubPntBc_B = start.inertia.tolist()
        rotation = Rotation.from_quat(np.roll(start.quaternion, -1))
        hub.hub.sigma_BNInit = rotation.as_mrp()[:, np.newaxis].tolist()
        hub.hub.omega_BN_BInit = start.omega[:, np.newaxis].tolist()
        self._wheels = reactionWheelStateEffector.ReactionWheelStateEffector()
        factory = simIncludeRW.rwFactory()
        names = ("rotor_inertia", "initial_speed")
        for axis, inertia, speed in zip(
            start.wheels.unit_axes, *map(start.wheels.values, names), strict=True
        ):
            wheel = factory.create(
                "custom",
                axis.tolist(),
                Js=float(inertia),
                useMaxTorque=False,
                RWModel=messaging.BalancedWheels,
            )
            wheel.gsHat_B = axis[:, np.newaxis].tolist()
            wheel.Omega = float(speed)
        factory.addToSpacecraft("wheels", self._wheels, hub)
        self._motors = messaging.ArrayMotorTorqueMsg().write(messaging.ArrayMotorTorqueMsgPayload())
        self._wheels.rwMotorCmdInMsg.subscribeTo(self._motors)
        self._integrator = svIntegrators.svIntegratorRK4(hub)
        hub.setIntegrator(self._integrator)
        for module in (self._wheels, hub):
            simulation.AddModelToTask("task", module)
        simulation.InitializeSimulation()
        simulation.ConfigureStopTime(0)
        simulation.ExecuteSimulation()
        self._steps = 0

    def fly(self, torque: Array) -> tuple[Array, Array, Array]:
        payload = messaging.ArrayMotorTorqueMsgPayload()
        payload.motorTorque = torque.tolist()
        self._motors.write(payload)
        self._steps += HELD_STEPS
        self._simulation.ConfigureStopTime(self._steps * self._period_ns)
        self._simulation.ExecuteSimulation()
        hub = self._hub.scStateOutMsg.read()
        rotation = Rotation.from_matrix(RigidBodyKinematics.MRP2C(hub.sigma_BN).T)
        speeds = np.array(self._wheels.rwSpeedOutMsg.read().wheelSpeeds[: torque.size])
        quaternion: Array = np.roll(rotation.as_quat(), 1)
        return quaternion, np.array(hub.omega_BN_B), speeds
