"""The numbers of a robot in the form that the compiled algorithms read."""

from __future__ import annotations

from space_robot_msgs_py.compiled.records import assign

from ..dynamics.model import Model
from .inertia import inertia_elements
from .tree import TreeArrays


def model_of(robot: TreeArrays) -> Model:
    """Fill a `Model`, whose joints are in the order of visits."""
    model, count, order = Model.allocate(robot.n), robot.joint_count, list(robot.order)
    bodies = [0, *(joint + 1 for joint in order)]
    row_of_body = {body: row for row, body in enumerate(bodies)}
    assign(model, joint_count=count, actuated_count=robot.n)
    model.mass[: count + 1] = robot.mass[bodies]
    model.inertia[: count + 1] = inertia_elements(robot.inertia[bodies])
    model.com[: count + 1] = robot.com[bodies]
    model.rotation[:count] = robot.rotation[order].reshape(count, 9)
    model.offset[:count] = robot.offset[order]
    model.is_prismatic[:count] = robot.is_prismatic[order]
    for row, joint in enumerate(order):
        parent = row_of_body[int(robot.parent[joint])]
        model.row[joint], model.parent[row] = row, parent
        model.continues[row] = parent == row
        if parent != row:
            model.branches[parent] = 1.0
        if joint >= robot.n:
            spring = robot.springs[joint - robot.n]
            model.stiffness[row], model.damping[row], model.rest[row] = spring
    return model
