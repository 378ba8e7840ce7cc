"""Trees capture and release in flight: Pinocchio's momenta and energies before, during, after."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_inertia, random_quaternion
from tree_flight import PERIOD, SEEDS, TORQUE, TreeFlight, tree

from space_robot_model.robot.inertia import inertia_tensor
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]
PUSH, CAPTURE, RELEASE = 100, 200, 500
"""Ticks: the motors push until the first one; then joints and springs move freely."""
SPEED = 0.7


class Whole(NamedTuple):
    """Of robot and target together; momenta about the inertial origin."""

    linear: Array
    angular: Array
    energy: float


class Captured(TreeFlight):
    """A random tree that holds a target for some time."""

    def __init__(self, seed: int, hand: str) -> None:
        rng = np.random.default_rng(seed)
        bodies = tree(seed, lossless=True)
        carrier = next(body for body in bodies if body.name == hand)
        self.tool = carrier.tools[0]
        self.target = Target.from_dict(
            {
                "target": {
                    "mass": 30.0,
                    "inertia": random_inertia(rng, 3.0),
                    "tool": self.tool.name,
                    "place": {
                        "position": rng.normal(size=3).tolist(),
                        "quaternion": random_quaternion(rng).tolist(),
                    },
                    "motion": {
                        "relative_to": "inertial",
                        "velocity": rng.normal(size=3).tolist(),
                        "angular_velocity": rng.normal(size=3).tolist(),
                    },
                }
            }
        )
        events = [
            f"capture@{CAPTURE * PERIOD}:{self.target.inline}",
            f"release@{RELEASE * PERIOD}:{SPEED}",
        ]
        super().__init__(bodies, 0.0, events=events)
        body = self.model.frames[self.model.getFrameId(hand, pin.FrameType.BODY)]
        at_tool = body.placement * pin.SE3(self.tool.rotation, self.tool.position)
        place = self.target.place
        turn = rotation_of(place.quaternion).as_matrix()
        self._frames = [
            self.model.addFrame(pin.Frame(name, body.parentJoint, at, pin.FrameType.OP_FRAME))
            for name, at in (
                ("hand", at_tool),
                ("held", at_tool * pin.SE3(turn, np.array(place.position))),
            )
        ]
        self.data = self.model.createData()

    def placed(self) -> tuple[pin.SE3, pin.SE3, pin.Motion]:
        """The tool, the target in it, and the velocity that it has there."""
        q, v = self.configuration()
        pin.forwardKinematics(self.model, self.data, q, v)
        hand, held = (pin.updateFramePlacement(self.model, self.data, f) for f in self._frames)
        motion = pin.getFrameVelocity(
            self.model, self.data, self._frames[1], pin.LOCAL_WORLD_ALIGNED
        )
        return hand.copy(), held.copy(), motion

    def alone(self) -> Whole:
        """The robot without a target."""
        q, v = self.configuration()
        found = pin.computeCentroidalMomentum(self.model, self.data, q, v)
        linear = found.linear.copy()
        angular = found.angular + np.cross(self.data.com[0], linear)
        energy = pin.computeKineticEnergy(self.model, self.data, q, v) + self.spring_energy()
        return Whole(linear, angular, energy)

    def with_target(self, v: Any, w: Any) -> Whole:
        """With a target where the tool has it, that moves so, m/s and rad/s."""
        _, held, _ = self.placed()
        robot, mass, v, w = self.alone(), self.target.mass, np.array(v), np.array(w)
        spin = held.rotation @ inertia_tensor(self.target.inertia) @ held.rotation.T @ w
        return Whole(
            robot.linear + mass * v,
            robot.angular + spin + mass * np.cross(held.translation, v),
            robot.energy + 0.5 * (mass * v @ v + w @ spin),
        )

    def holding(self) -> Whole:
        _, _, motion = self.placed()
        return self.with_target(motion.linear, motion.angular)


def assert_kept(found: Whole, expected: Whole, tolerance: float) -> None:
    scale = max(float(np.abs(np.concatenate(expected[:2])).max()), 1.0)
    np.testing.assert_allclose(found.linear, expected.linear, rtol=0.0, atol=tolerance * scale)
    np.testing.assert_allclose(found.angular, expected.angular, rtol=0.0, atol=tolerance * scale)


@pytest.mark.parametrize(("seed", "hand"), list(zip(SEEDS, ("b4", "b6", "hull"), strict=True)))
def test_robot_and_target_keep_their_momenta(seed: int, hand: str) -> None:
    """In the grasp, while it holds, and at the release, with sliding and passive joints."""
    flight = Captured(seed, hand)
    assert flight.plant.robot.mass.sum() == flight.robot.mass.sum()
    flight.fly(TORQUE * 20.0, PUSH)
    flight.fly(np.zeros(6), CAPTURE - PUSH - 1)
    alone = flight.alone()
    assert np.linalg.norm(alone.angular) > 1.0
    flight.fly(np.zeros(6), 1)
    motion, held = flight.target.motion, flight.holding()
    # what the robot had a tick before it has still; the place of the target is that of the grasp
    own = flight.with_target(motion.velocity, motion.angular_velocity)
    bare = flight.alone()
    own = Whole(
        alone.linear + own.linear - bare.linear,
        alone.angular + own.angular - bare.angular,
        alone.energy + own.energy - bare.energy,
    )
    assert_kept(held, own, 1e-11)
    assert held.energy < own.energy
    assert flight.plant.robot.mass.sum() == pytest.approx(flight.robot.mass.sum() + 30.0)

    flight.fly(np.zeros(6), RELEASE - CAPTURE - 1)
    later = flight.holding()
    assert_kept(later, held, 1e-10)
    assert later.energy == pytest.approx(held.energy, rel=1e-8)

    flight.fly(np.zeros(6), 1)
    tool, _, motion = flight.placed()
    left = flight.with_target(motion.linear + SPEED * tool.rotation[:, 2], motion.angular)
    assert_kept(left, later, 1e-10)
    assert flight.plant.robot is flight.robot
    gone = flight.alone()
    flight.fly(np.zeros(6), 200)
    assert_kept(flight.alone(), gone, 1e-10)
    assert flight.alone().energy == pytest.approx(gone.energy, rel=1e-8)
