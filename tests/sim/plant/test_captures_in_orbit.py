"""A plant whose tool meets a target on a neighbouring orbit, or misses it."""

from __future__ import annotations

import pickle
from typing import Any, NamedTuple

import numpy as np
import pytest
from meeting_targets import circular_orbit, held_place, meeting_target, tensor_of
from numpy.typing import NDArray
from oracles import rotation_of
from orbiting_robots import (
    ANGLES_DEG,
    NO_FRICTION,
    BodyMotion,
    body_motions,
    coast,
    orbiting_plant,
    set_motion,
)

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.neighbouring_orbit import meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant

Array = NDArray[np.float64]

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


class OriginMomenta(NamedTuple):
    """Momenta about the inertial frame's origin."""

    linear: Array
    angular: Array


def whole(bodies: list[BodyMotion]) -> OriginMomenta:
    linear = [body.mass * body.velocity for body in bodies]
    angular = [body.spin + body.mass * np.cross(body.position, body.velocity) for body in bodies]
    return OriginMomenta(np.sum(linear, axis=0), np.sum(angular, axis=0))


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


def as_body(target: Target, position: Array, axes: Array, velocity: Array, w: Array) -> BodyMotion:
    inertia = axes @ tensor_of(target) @ axes.T
    spin = inertia @ w
    return BodyMotion(target.mass, position, velocity, inertia, spin, float(0.5 * w @ spin))


def in_the_hand(robot: Robot, state: RobotState, target: Target) -> BodyMotion:
    """Return the motion of a target that moves with the tool's body.

    From Pinocchio's bodies: the hand's angular velocity is that of its spin.
    """
    hand = body_motions(robot, state)[1 + robot.tool.body - 1]
    w = np.linalg.solve(hand.inertia, hand.spin)
    place, axes = held_place(robot, state, target)
    return as_body(target, place, axes, hand.velocity + np.cross(w, place - hand.position), w)


def test_what_is_met_is_held_with_the_momenta_of_both(
    paper_robot: Robot, before: RobotState, target: Target
) -> None:
    """Linear and angular about the origin, to 1e-12; not with a velocity from elsewhere."""
    plant = flying_plant(paper_robot, events_of(target))
    after = coast(plant, CAPTURE)
    np.testing.assert_array_equal(after.base_position, before.base_position)
    np.testing.assert_array_equal(after.quaternion, before.quaternion)
    np.testing.assert_array_equal(after.joint_positions, before.joint_positions)
    assert np.abs(after.joint_velocities - before.joint_velocities).max() > 1e-2
    meeting = meet(target, ORBIT, CAPTURE * PERIOD)
    _, axes = held_place(paper_robot, before, target)
    velocity, w = (np.array(v) for v in (meeting.motion.velocity, meeting.motion.angular_velocity))
    own = as_body(target, meeting.position, axes, velocity, w)
    expected = whole([*body_motions(paper_robot, before), own])
    held = in_the_hand(paper_robot, after, target)
    found = whole([*body_motions(paper_robot, after), held])
    np.testing.assert_allclose(held.position, meeting.position, rtol=0.0, atol=1e-7)
    scale = float(np.abs(np.concatenate(expected)).max())
    assert scale > 1.0
    # the target is a little beside its place: its momentum about the origin is that of the place
    moved = target.mass * np.cross(held.position - meeting.position, velocity)
    np.testing.assert_allclose(found.linear, expected.linear, rtol=0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(
        found.angular, expected.angular + moved, rtol=0.0, atol=1e-12 * scale
    )
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + target.mass)
    assert plant.captures.misses == {}


def test_velocities_after_are_those_of_the_impact(
    paper_robot: Robot, before: RobotState, target: Target
) -> None:
    """The plant's are those of `Impact` with the motion that the target has by then."""
    after = coast(flying_plant(paper_robot, events_of(target)), CAPTURE)
    captures = Captures([Capture(CAPTURE * PERIOD, target)], paper_robot, PERIOD, ORBIT)
    (exchange,) = captures.at(CAPTURE)
    assert exchange.meeting is not None
    impact = exchange.impact(
        before.quaternion, before.joint_positions, np.zeros((0, 3)), np.zeros(0)
    )
    assert captures.happens(exchange, impact, before.base_position)

    def velocities(state: RobotState) -> Array:
        turned = held_axes(state) @ state.omega_base
        return np.concatenate([state.base_velocity, turned, state.joint_velocities])

    def held_axes(state: RobotState) -> Array:
        return np.asarray(rotation_of(state.quaternion).as_matrix())

    expected = impact.capture(exchange.meeting.motion, velocities(before))
    np.testing.assert_allclose(velocities(after), expected, rtol=0.0, atol=1e-13)
    back = exchange.velocity_before(impact, velocities(after))
    np.testing.assert_allclose(back, velocities(before), rtol=0.0, atol=1e-10)


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


def test_after_a_release_the_robot_is_the_bare_one(paper_robot: Robot, target: Target) -> None:
    """The target goes at the spring's speed, and the momenta of both stay."""
    plant = flying_plant(paper_robot, events_of(target))
    coast(plant, RELEASE - 1)
    held = plant.robot.mass.sum()
    state = coast(plant, 1)
    assert held == pytest.approx(paper_robot.mass.sum() + target.mass)
    assert plant.robot.mass.sum() == paper_robot.mass.sum()
    with_target = flying_plant(paper_robot, events_of(target)[:1])
    kept = coast(with_target, RELEASE)
    before = whole([*body_motions(paper_robot, kept), in_the_hand(paper_robot, kept, target)])
    gone = in_the_hand(paper_robot, state, target)
    hand, tool = held_place(paper_robot, state, target)[1], target.place.quaternion
    along = hand @ rotation_of(tool).inv().as_matrix()
    pushed = as_body(
        target,
        gone.position,
        hand,
        gone.velocity + SPEED * along[:, 2],
        np.linalg.solve(gone.inertia, gone.spin),
    )
    after = whole([*body_motions(paper_robot, state), pushed])
    scale = float(np.abs(np.concatenate(before)).max())
    for found, expected in zip(after, before, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)


def test_a_target_missed_may_be_followed_by_another(paper_robot: Robot, target: Target) -> None:
    """One is missed and released; one that stands still in the hand is then held."""
    still = Target.from_dict({"target": {"mass": 10.0, "inertia": [1.0, 1.0, 1.0, 0, 0, 0]}})
    events = [*events_of(beside(target, 1.0)), f"capture@{(RELEASE + 10) * PERIOD}:{still.inline}"]
    plant = flying_plant(paper_robot, events)
    coast(plant, END)
    assert plant.captures.misses.keys() == {CAPTURE}
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + 10.0)


@pytest.mark.parametrize("distance", [0.0, 0.3])
def test_a_snapshot_is_gone_back_to_from_behind_the_capture(
    paper_robot: Robot, target: Target, distance: float
) -> None:
    plant = flying_plant(paper_robot, events_of(beside(target, distance)))
    coast(plant, CAPTURE - 50)
    snapshot = plant.save()
    first = states_of(plant, END - CAPTURE + 50)
    plant.restore(snapshot)
    assert plant.robot.mass.sum() == paper_robot.mass.sum()
    assert states_of(plant, END - CAPTURE + 50) == first


def test_a_copy_flies_on_to_the_same_bits(paper_robot: Robot, target: Target) -> None:
    for distance in (0.0, 0.3):
        plant = flying_plant(paper_robot, events_of(beside(target, distance)))
        coast(plant, CAPTURE + 50)
        other = pickle.loads(pickle.dumps(plant))
        assert states_of(plant, END - CAPTURE) == states_of(other, END - CAPTURE)


def test_a_snapshot_knows_whether_its_target_was_missed(paper_robot: Robot, target: Target) -> None:
    """One flight hits; from a state before, another is led away and misses, or the reverse."""
    plant = flying_plant(paper_robot, events_of(target))
    coast(plant, 10)
    begin = plant.save()
    coast(plant, CAPTURE)
    hit = plant.save()
    released = states_of(plant, END - CAPTURE - 10)

    plant.restore(begin)
    away(plant)
    coast(plant, CAPTURE - 20)
    assert plant.captures.misses.keys() == {CAPTURE}
    missed = plant.save()
    alone = states_of(plant, END - CAPTURE - 20)

    plant.restore(hit)
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + target.mass)
    assert states_of(plant, END - CAPTURE - 10) == released
    plant.restore(missed)
    assert plant.robot.mass.sum() == paper_robot.mass.sum()
    assert states_of(plant, END - CAPTURE - 20) == alone


def away(plant: Plant) -> None:
    """Turn the arm away by its motors over some ticks."""
    command = np.zeros(len(plant.names.commanded))
    command[3:9] = [2000.0, 2000.0, 0.0, 0.0, 0.0, 0.0]
    for _ in range(30):
        plant.step(Command(plant.tick, command))


def test_without_an_orbit_a_plant_is_refused_in_one_line(
    paper_robot: Robot, target: Target
) -> None:
    nowhere: dict[str, Any] = {"orbital_elements": {}, "gravity": {}}
    with pytest.raises(InputError, match=r"target 'drifter': motion\.relative_to") as caught:
        orbiting_plant(paper_robot, PERIOD, events=events_of(target), **nowhere)
    assert "\n" not in str(caught.value)
