"""Basilisk: an N-link `spinningBodyNDOFStateEffector` on a rigid hub, stepped by its engine."""

from __future__ import annotations

from typing import Any

import numpy as np
from Basilisk.architecture import bskLogging, messaging
from Basilisk.simulation import (
    extForceTorque,
    spacecraft,
    spinningBodyNDOFStateEffector,
    svIntegrators,
)
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass
from kernels import Array
from scipy.spatial.transform import Rotation
from start import PERIOD, Start

from space_robot import mass_matrix

bskLogging.setDefaultLogLevel(bskLogging.BSK_WARNING)


class Basilisk:
    """Spacecraft, arm and constant torques in one task of 0.5 ms, integrated by RK4."""

    name = "basilisk"

    def __init__(self, start: Start, viscous: float = 0.0) -> None:
        self._simulation = SimulationBaseClass.SimBaseClass()
        self._period_ns, self._steps = round(PERIOD * 1e9), 0
        process = self._simulation.CreateNewProcess("process")
        process.addTask(self._simulation.CreateNewTask("task", self._period_ns))
        arm, hub = self._arm, self._hub = _arm(start, viscous), _hub(start)
        hub.addStateEffector(arm)
        push = extForceTorque.ExtForceTorque()
        push.ModelTag = "torque"
        push.extTorquePntB_B = _column(start.torque[:3])
        modules: list[Any] = [arm, hub]
        if np.any(start.torque):
            hub.addDynamicEffector(push)
            motors = messaging.ArrayMotorTorqueMsgPayload()
            motors.motorTorque = start.torque[3:].tolist()
            self._motors = messaging.ArrayMotorTorqueMsg().write(motors)
            arm.motorTorqueInMsg.subscribeTo(self._motors)
            modules.insert(0, push)
        self._kept = push, svIntegrators.svIntegratorRK4(hub)
        hub.setIntegrator(self._kept[1])
        for module in modules:
            self._simulation.AddModelToTask("task", module)
        self._simulation.InitializeSimulation()
        self.step(0)

    def step(self, steps: int) -> None:
        """Integrate."""
        self._steps += steps
        self._simulation.ConfigureStopTime(self._steps * self._period_ns)
        self._simulation.ExecuteSimulation()

    @property
    def x(self) -> Array:
        """The state reached."""
        hub = self._hub.scStateOutMsg.read()
        turn = Rotation.from_matrix(RigidBodyKinematics.MRP2C(hub.sigma_BN).T)
        names = self._arm.getNameOfThetaState(), self._arm.getNameOfThetaDotState()
        theta, rate = (np.ravel(self._hub.dynManager.getStateObject(n).getState()) for n in names)
        quaternion = np.roll(turn.as_quat(), 1)
        parts = hub.r_BN_N, quaternion, theta, hub.v_BN_N, turn.apply(hub.omega_BN_B), rate
        return np.concatenate(parts)


def _arm(start: Start, viscous: float) -> Any:
    robot = start.robot
    arm = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    arm.ModelTag = "arm"
    for i in range(robot.n):
        link, twist = spinningBodyNDOFStateEffector.SpinningBody(), robot.rotation[i]
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


def _hub(start: Start) -> Any:
    """Return the base; Basilisk starts from the motion of the whole system's centre of mass."""
    robot = start.robot
    inertia = mass_matrix(robot, start.quaternion, start.theta)
    skew = -inertia[:3, 3:6] / inertia[0, 0]
    velocity = inertia[:3] @ np.concatenate([start.v0, start.w0, start.rate]) / inertia[0, 0]
    hub = spacecraft.Spacecraft()
    hub.ModelTag = "base"
    hub.hub.mHub = robot.mass[0]
    hub.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    hub.hub.IHubPntBc_B = robot.inertia[0].tolist()
    hub.hub.r_CN_NInit = _column(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))
    hub.hub.v_CN_NInit = _column(velocity)
    hub.hub.sigma_BNInit = _column(start.rotation.as_mrp())
    hub.hub.omega_BN_BInit = _column(start.rotation.inv().apply(start.w0))
    return hub


def _column(vector: Array) -> list[list[float]]:
    return [[float(value)] for value in vector]
