"""Basilisk: an N-link `spinningBodyNDOFStateEffector` on a rigid hub, stepped by its engine."""

from __future__ import annotations

import numpy as np
from Basilisk.architecture import bskLogging, messaging
from Basilisk.simulation import (
    extForceTorque,
    spacecraft,
    spinningBodyNDOFStateEffector,
    svIntegrators,
)
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass
from numpy.typing import NDArray
from oracles import quaternion_of, rotation_of
from scipy.spatial.transform import Rotation

from space_robot import mass_matrix

from .simulators import PERIOD, Start

Array = NDArray[np.float64]

bskLogging.setDefaultLogLevel(bskLogging.BSK_WARNING)


class Basilisk:
    """Spacecraft, arm and constant torques in one task of 0.5 ms, integrated by RK4."""

    name = "basilisk"

    def __init__(self, start: Start, viscous: float = 0.0) -> None:
        self._n = start.robot.n
        self._simulation = SimulationBaseClass.SimBaseClass()
        self._period_ns = round(PERIOD * 1e9)
        process = self._simulation.CreateNewProcess("process")
        process.addTask(self._simulation.CreateNewTask("task", self._period_ns))
        self._arm = _arm(start, viscous)
        self._hub = _hub(start)
        self._hub.addStateEffector(self._arm)
        self._integrator = svIntegrators.svIntegratorRK4(self._hub)
        self._hub.setIntegrator(self._integrator)
        modules = [self._arm, self._hub]
        if np.any(start.torque):
            modules.insert(0, self._push(start.torque))
        for module in modules:
            self._simulation.AddModelToTask("task", module)
        self._simulation.InitializeSimulation()
        self._simulation.ConfigureStopTime(0)
        self._simulation.ExecuteSimulation()
        self._steps = 0

    def _push(self, torque: Array) -> extForceTorque.ExtForceTorque:
        on_base = extForceTorque.ExtForceTorque()
        on_base.ModelTag = "torque"
        on_base.extTorquePntB_B = _column(torque[:3])
        self._hub.addDynamicEffector(on_base)
        motors = messaging.ArrayMotorTorqueMsgPayload()
        motors.motorTorque = torque[3:].tolist()
        self._motors = messaging.ArrayMotorTorqueMsg().write(motors)
        self._arm.motorTorqueInMsg.subscribeTo(self._motors)
        return on_base

    def step(self, steps: int) -> None:
        self._steps += steps
        self._simulation.ConfigureStopTime(self._steps * self._period_ns)
        self._simulation.ExecuteSimulation()

    @property
    def x(self) -> Array:
        hub = self._hub.scStateOutMsg.read()
        rotation = Rotation.from_matrix(RigidBodyKinematics.MRP2C(hub.sigma_BN).T)
        manager, arm = self._hub.dynManager, self._arm
        theta, rate = (
            np.ravel(manager.getStateObject(name).getState())
            for name in (arm.getNameOfThetaState(), arm.getNameOfThetaDotState())
        )
        w0 = rotation.apply(hub.omega_BN_B)
        quaternion = quaternion_of(rotation)
        return np.concatenate([hub.r_BN_N, quaternion, theta, hub.v_BN_N, w0, rate])


def _arm(start: Start, viscous: float) -> spinningBodyNDOFStateEffector:
    robot = start.robot
    arm = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    arm.ModelTag = "arm"
    for i in range(robot.n):
        link = spinningBodyNDOFStateEffector.SpinningBody()
        twist = robot.rotation[i]
        link.setMass(robot.mass[i + 1])
        link.setISPntSc_S(robot.inertia[i + 1].tolist())
        link.setDCM_S0P(twist.T.tolist())
        link.setR_ScS_S(_column(robot.com[i + 1]))
        link.setR_SP_P(_column(twist @ robot.offset[i]))
        link.setSHat_S([[0.0], [0.0], [1.0]])
        link.setThetaInit(start.theta[i])
        link.setThetaDotInit(start.rate[i])
        link.setK(0.0)
        link.setC(viscous)
        arm.addSpinningBody(link)
    return arm


def _hub(start: Start) -> spacecraft.Spacecraft:
    """The base; Basilisk starts from the motion of the whole system's centre of mass."""
    robot = start.robot
    inertia = mass_matrix(robot, start.quaternion, start.theta)
    total = inertia[0, 0]
    skew = -inertia[:3, 3:6] / total
    velocity = np.concatenate([start.v0, start.w0, start.rate])
    hub = spacecraft.Spacecraft()
    hub.ModelTag = "base"
    hub.hub.mHub = robot.mass[0]
    hub.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    hub.hub.IHubPntBc_B = robot.inertia[0].tolist()
    hub.hub.r_CN_NInit = _column(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))
    hub.hub.v_CN_NInit = _column(inertia[:3] @ velocity / total)
    rotation = rotation_of(start.quaternion)
    hub.hub.sigma_BNInit = _column(rotation.as_mrp())
    hub.hub.omega_BN_BInit = _column(rotation.inv().apply(start.w0))
    return hub


def _column(vector: Array) -> list[list[float]]:
    return [[float(value)] for value in vector]
