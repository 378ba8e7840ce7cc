"""The numbers of a `Robot` in the form that the compiled algorithms read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from space_robot_msgs_py.compiled.records import assign

from ..dynamics.model import Model
from .file import inertia_elements

if TYPE_CHECKING:
    from .robot import Robot


def model_of(robot: Robot) -> Model:
    """Fill a `Model`; see there for what stands where."""
    model, bodies, joints = Model.allocate(robot.n), robot.joint_count + 1, robot.joint_count
    assign(model, joint_count=joints, actuated_count=robot.n)
    model.mass[:bodies] = robot.mass
    model.inertia[:bodies] = inertia_elements(robot.inertia)
    model.com[:bodies] = robot.com
    model.rotation[:joints] = robot.rotation.reshape(joints, 9)
    model.offset[:joints] = robot.offset
    model.is_prismatic[:joints] = robot.is_prismatic
    model.parent[:joints] = robot.parent
    model.order[:joints] = robot.order
    for j, spring in enumerate(robot.springs, robot.n):
        model.stiffness[j], model.damping[j], model.rest[j] = spring
    visited = (0, *(joint + 1 for joint in robot.order))
    for before, joint in zip(visited, robot.order, strict=False):
        continues = robot.parent[joint] == before
        model.continues[joint] = continues
        if not continues:
            model.branches[robot.parent[joint]] = 1.0
    return model
