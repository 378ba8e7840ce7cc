"""Shapes and plates of a robot: those of its file, or derived from kinematics and masses.

Plates are pushed by air and light, so they have the same bits on every processor: no BLAS here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..elementary.linear_algebra import principal_axes
from ..elementary.matrices import Array, norm, product
from .parts import Colour, Plate, Visual, moved

if TYPE_CHECKING:
    from .robot import Robot

BASE_COLOUR: Colour = (0.80, 0.66, 0.30, 1.0)
LINK_COLOUR: Colour = (0.82, 0.83, 0.86, 1.0)
JOINT_COLOUR: Colour = (0.25, 0.28, 0.33, 1.0)
PANEL_COLOUR: Colour = (0.13, 0.23, 0.48, 1.0)
THINNEST = 0.02
"""Smallest edge of a box and smallest radius of a tube, m."""
SLENDER = 0.018
"""Radius of a tube relative to the length of all links."""


def shapes_of(robot: Robot) -> tuple[Visual, ...]:
    """Return the visuals of a robot's file, or derived ones if it has none.

    The base and bodies on passive joints are boxes of uniform density with the body's mass and
    inertia; other bodies are tubes from their joint to the next ones and to the tools, with a hub
    at each joint's axis.
    """
    return robot.visuals or tuple(drawn_shapes(robot))


def drawn_shapes(robot: Robot) -> Iterator[Visual]:
    """Yield the derived shapes of `shapes_of`, also for a robot with visuals."""
    ends = _ends(robot)
    lengths = sum(norm(end) for body in ends[1:] for end in body)
    radius = max(THINNEST, SLENDER * lengths)
    for body, own in enumerate(ends):
        is_base, is_panel = body == 0, body > robot.n
        start: Array = np.zeros(3)
        if is_base or is_panel:
            box = even_box(
                float(robot.mass[body]),
                robot.inertia[body],
                robot.com[body],
                body,
                BASE_COLOUR if is_base else PANEL_COLOUR,
            )
            yield box
        else:
            hub = (1.5 * radius, 3.2 * radius)
            yield Visual("cylinder", hub, np.eye(3), start, colour=JOINT_COLOUR, body=body)
            if reach := _reach(robot, body - 1):
                yield from _tube(np.array([0.0, 0.0, -reach]), start, 0.7 * radius, body)
        for end in own if not is_panel else ():
            if is_base:  # from the surface of the box
                half = 0.5 * np.array(box.size)
                start = product(box.rotation, np.clip(product(box.rotation.T, end), -half, half))
            yield from _tube(start, end, radius, body)


def even_box(mass: float, inertia: Array, com: Array, body: int, colour: Colour) -> Visual:
    """Return the box of uniform density with this mass, centre of mass and inertia.

    Args:
        mass: kg.
        inertia: (3, 3) about the centre of mass, kg m2, in body axes.
        com: (3,) centre of mass, m, in body axes.
        body: number of the body.
        colour: of the box.
    """
    # second moments of an even box: m / 12 times its edges squared
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments, axes = principal_axes(second)
    edges = np.sqrt(12.0 * np.maximum(moments, 0.0) / mass)
    # eigenvectors may be a left-handed frame
    if product(np.cross(axes[:, 0], axes[:, 1]), axes[:, 2]) < 0.0:
        axes[:, 0] *= -1.0
    size = tuple(np.maximum(edges, THINNEST).tolist())
    return Visual("box", size, axes, com, colour=colour, body=body)


def _reach(robot: Robot, joint: int) -> float:
    """Return the travel of a prismatic joint, m, by which the body stays in its parent; else 0."""
    if not robot.is_prismatic[joint] or joint >= robot.n:
        return 0.0
    upper = robot.limits[joint].upper
    return upper if 0.0 < upper < np.inf else 0.0


def _ends(robot: Robot) -> list[list[Array]]:
    """Return for each body the positions, m, of its joints and tools, in body axes."""
    ends: list[list[Array]] = [[] for _ in robot.body_names]
    for joint in robot.order:
        turn = robot.rotation[joint]
        ends[robot.parent[joint]].append(product(turn, robot.offset[joint]))
    for tool in robot.tools:
        ends[tool.body].append(tool.position)
    return ends


def _tube(start: Array, end: Array, radius: float, body: int) -> Iterator[Visual]:
    along = end - start
    length = norm(along)
    if length < THINNEST:
        return
    yield Visual(
        "cylinder",
        (radius, length),
        _turn_to(along / length),
        0.5 * (start + end),
        colour=LINK_COLOUR,
        body=body,
    )


def _turn_to(z: Array) -> Array:
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= norm(x)
    return np.column_stack((x, np.cross(z, x), z))


SIDES = 6
"""Plates around a cylinder."""
COSINES = (1.0, 0.5, -0.5, -1.0, -0.5, 0.5)
SINES = (0.0, np.sqrt(0.75), np.sqrt(0.75), 0.0, -np.sqrt(0.75), -np.sqrt(0.75))
"""Of their directions."""


def plates_of(robot: Robot) -> tuple[Plate, ...]:
    """Return the plates of the robot's file, or if it has none those of its shapes.

    A box has six, a cylinder six around it and two ends, a sphere is a box; together they have the
    surface of the shape. Meshes are replaced by the shapes that kinematics and masses give
    (`space_robot_model.robot.shapes`).
    """
    if robot.plates:
        return robot.plates
    shapes = robot.visuals
    if not shapes or any(shape.shape == "mesh" for shape in shapes):
        shapes = tuple(drawn_shapes(robot))
    return tuple(plate for shape in shapes for plate in _plates(shape))


def _plates(shape: Visual) -> Iterator[Plate]:
    def at(centre: Array) -> Array:
        return shape.position + product(shape.rotation, centre)

    if shape.shape == "cylinder":
        plates = _cylinder_plates(*shape.size)
    elif shape.shape == "sphere":
        edge = np.sqrt(2.0 * np.pi / 3.0) * shape.size[0]  # 6 edge^2 = 4 pi radius^2
        plates = _box_plates((edge, edge, edge))
    else:
        plates = _box_plates(shape.size)
    for plate in plates:
        yield moved(plate, shape.rotation, at, body=shape.body)


def _box_plates(edges: tuple[float, ...]) -> Iterator[Plate]:
    for axis, edge in enumerate(edges):
        area = edges[axis - 1] * edges[axis - 2]
        for side in (1.0, -1.0):
            normal = side * np.eye(3)[axis]
            yield Plate(area, normal, 0.5 * edge * normal)


def _cylinder_plates(radius: float, length: float) -> Iterator[Plate]:
    for side in (1.0, -1.0):
        end = np.array([0.0, 0.0, side])
        yield Plate(np.pi * radius**2, end, 0.5 * length * end)
    for cosine, sine in zip(COSINES, SINES, strict=True):
        normal = np.array([cosine, sine, 0.0])
        yield Plate(2.0 * np.pi * radius * length / SIDES, normal, radius * normal)
