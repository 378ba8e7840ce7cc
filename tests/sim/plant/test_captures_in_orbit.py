"""A plant whose tool meets a target on a neighbouring orbit, or misses it."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.momenta import momentum
from oracles.orbit import BodyMotion, body_motions, whole_momenta
from robots import (
    ANGLES_DEG,
    NO_FRICTION,
    circular_orbit,
    coast,
    held_place,
    meeting_target,
    orbiting_plant,
    set_motion,
    tensor_of,
)

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.environment.neighbouring_orbit import meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant

PERIOD = 1e-3
CAPTURE, RELEASE, END = 200, 400, 500
"""Ticks."""
SPEED = 0.3
"""m/s of the release."""
REACH = 0.05
ORBIT = circular_orbit(420e3)
RATES = [0.1, -0.2, 0.15, 0.3, -0.1, 0.2]
TUMBLING = {
    "velocity": [0.2, -0.1, 0.3],
    "quaternion": [0.5, -0.1, 0.7, 0.4],
    "angular_velocity": [0.2, -0.1, 0.15],
    "reach": REACH,
}


def flying_plant(robot: Robot, events: list[str], orbit: OrbitSettings = ORBIT) -> Plant:
    """Return a plant whose base and arm move, and that nobody turns."""
    plant = orbiting_plant(
        robot,
        PERIOD,
        initial_joints_deg=ANGLES_DEG,
        friction=NO_FRICTION,
        events=events,
        **orbit.model_dump(),
    )
    set_motion(plant, [0.1, 0.2, -0.1], [0.02, -0.01, 0.03], [0.1, -0.05, 0.08], RATES)
    return plant


@pytest.fixture(scope="module")
def before(paper_robot: Robot) -> RobotState:
    """The state in which the capture happens, a moment before it."""
    return coast(flying_plant(paper_robot, []), CAPTURE).copy()


@pytest.fixture(scope="module")
def target(paper_robot: Robot, before: RobotState) -> Target:
    """One that the tool meets."""
    some = meeting_target(ORBIT, 0.0, np.zeros(3))
    place, _ = held_place(paper_robot, before, some)
    return meeting_target(ORBIT, CAPTURE * PERIOD, place, **TUMBLING)


def beside(target: Target, distance: float) -> Target:
    """Return a target that is as far as ``distance``, m, from the one that is met."""
    start = np.array(target.motion.position) + distance * np.array([2.0, -1.0, 2.0]) / 3.0
    motion = target.motion.model_copy(update={"position": start.tolist()})
    return target.model_copy(update={"motion": motion})


def events_of(target: Target) -> list[str]:
    return [f"capture@{CAPTURE * PERIOD}:{target.inline}", f"release@{RELEASE * PERIOD}:{SPEED}"]


def test_what_is_met_is_held_with_the_momenta_of_both(
    paper_robot: Robot, before: RobotState, target: Target
) -> None:
    """Linear and angular about the origin, to 1e-12; not with a velocity from elsewhere."""
    plant = flying_plant(paper_robot, events_of(target))
    after = coast(plant, CAPTURE)
    for name in ("base_position", "quaternion", "joint_positions"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert np.abs(after.joint_velocities - before.joint_velocities).max() > 1e-2
    meeting = meet(target, ORBIT, CAPTURE * PERIOD)
    # the target is a little beside its place: its momentum about the origin is that of the place
    place, axes = held_place(paper_robot, before, target)
    np.testing.assert_allclose(place, meeting.position, rtol=0.0, atol=1e-7)
    motion = (np.array(v) for v in (meeting.motion.velocity, meeting.motion.angular_velocity))
    own = BodyMotion.of(target.mass, place, axes, tensor_of(target), *motion)
    expected = np.array(whole_momenta([*body_motions(paper_robot, before), own]))
    scale = float(np.abs(expected).max())
    assert scale > 1.0
    found = momentum(plant.robot, after)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + target.mass)
    assert plant.captures.misses == {}
    coast(plant, RELEASE - CAPTURE)
    assert plant.robot is plant.captures.robot_at(0)


def states_of(plant: Plant, ticks: int) -> bytes:
    """Return all bits of the truth at each tick of a flight."""
    blocks = []
    for _ in range(ticks):
        coast(plant, 1)
        blocks.append(plant.truth.block.tobytes())
    return b"".join(blocks)


def test_what_is_missed_changes_no_bit_nor_does_its_release(
    paper_robot: Robot, target: Target
) -> None:
    missing = flying_plant(paper_robot, events_of(beside(target, 0.3)))
    without = flying_plant(paper_robot, [])
    assert states_of(missing, END) == states_of(without, END)
    assert missing.robot is missing.captures.robot_at(0)
    assert missing.robot.mass.sum() == paper_robot.mass.sum()
    ((tick, distance),) = missing.captures.misses.items()
    assert tick == CAPTURE
    # distances stay what they were, but for some 1e-8 of relative gravity
    assert distance == pytest.approx(0.3, rel=1e-6)


@pytest.mark.parametrize(("distance", "hits"), [(REACH - 1e-4, True), (REACH + 1e-4, False)])
def test_the_reach_is_the_largest_distance(
    paper_robot: Robot, target: Target, distance: float, hits: bool
) -> None:
    plant = flying_plant(paper_robot, events_of(beside(target, distance)))
    coast(plant, CAPTURE)
    assert bool(plant.captures.misses) is not hits
    held = target.mass if hits else 0.0
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + held, rel=1e-14)
