"""Drag and sunlight on the plates of a robot.

A plate of area A and outward normal n that moves against the air with velocity v, ``u = v / |v|``,
gets in free molecular flow, where it faces the wind (n . u > 0),

    F = -1/2 rho v^2 C_d A (n . u) u

and in the sunlight, with s the unit vector to the Sun and n . s > 0 (Wertz, Spacecraft Attitude
Determination and Control, 1978, section 17.2),

    F = -P A (n . s) ((1 - specular) s + 2 (specular (n . s) + diffuse / 3) n)

Plates do not shade one another. The velocity is that of the base's centre of mass: that of turning
is 1e-5 of it. Both are computed at the begin of a tick and held over it, as forces of actuators
are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    Matrix,
    Vector,
    add,
    cross,
    dot,
    load_frame,
    scale,
    store,
    subtract,
    transform,
    transform_transposed,
    vector,
)
from space_robot_model.dynamics.model import MOST_JOINTS, Data, Model
from space_robot_model.robot.parts import MOST_PLATES
from space_robot_model.robot.shapes import plates_of
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import whole
from space_robot_msgs_py.compiled.records import assign, shaped
from space_robot_msgs_py.errors import InputError

from ..component import Component, Installation
from .orbit import OrbitSettings

Array = NDArray[np.float64]

AREA, NORMAL, CENTRE, DRAG_COEFFICIENT, SPECULAR, DIFFUSE, BODY = 0, 1, 4, 7, 8, 9, 10
"""Columns of `Surfaces.plates`."""


def _plates(settings: OrbitSettings, at: Installation) -> list[list[float]]:
    robot = at.robot
    plates = plates_of(robot)
    if len(plates) > MOST_PLATES:
        raise InputError(
            f"robot {robot.name!r}: its shapes have {len(plates)} plates for drag and "
            f"sunlight, at most {MOST_PLATES} are allowed: give it its own (robot.plates)"
        )
    rows = []
    for number, body in enumerate([0, *(joint + 1 for joint in robot.order)], 1):
        for plate in plates:
            if plate.body == body:
                coefficients = plate.drag_coefficient, plate.specular, plate.diffuse
                rows.append([plate.area, *plate.normal, *plate.centre, *coefficients, number])
    return rows


class Surfaces(Component):
    """Plates of a robot, body by body, and the wrenches on its bodies."""

    count: float = shaped(lambda n: (), uniform=True)
    first: Array = shaped(lambda n: (MOST_JOINTS + 2,), uniform=True)
    """First plate of each body; that of the body behind the last is `count`."""
    plates: Array = shaped(lambda n: (MOST_PLATES, 11), source=_plates)
    """Area, normal, centre, coefficients, in body axes, and number of the body from 1, as `Model`
    orders them; see the columns' names."""
    wrench: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Moment about the base's CoM, N m, and force, N, on each body; inertial axes."""
    drag: Array = shaped(lambda n: (6,))
    """The same on the whole robot, of drag alone."""
    sunlight: Array = shaped(lambda n: (6,))
    """The same of sunlight."""

    @staticmethod
    def is_fitted(sheet: OrbitSettings) -> bool:
        """Return whether there is air or sunlight."""
        return sheet.has_surfaces

    @staticmethod
    def refresh(record: Any) -> None:
        """Update ``count`` and ``first``."""
        count = np.count_nonzero(record.plates[:, BODY])
        numbers = np.arange(1, MOST_JOINTS + 3)
        first = np.searchsorted(record.plates[:count, BODY], numbers)
        assign(record, count=count, first=first)


@kernel
def fill_surface_wrenches(
    surfaces: Surfaces,
    model: Model,
    velocity: Array,
    density: float,
    sun: Array,
    pressure: float,
    data: Data,
) -> None:
    """Fill the wrenches of drag and sunlight.

    ``velocity`` (m/s) is against the air of ``density`` (kg/m3); ``sun`` is the unit vector to the
    Sun, ``pressure`` (N/m2) that of its light, 0 in the shadow. Vectors are on inertial axes.
    """
    surfaces.drag[:] = 0.0
    surfaces.sunlight[:] = 0.0
    air = vector(velocity, 0)
    to_sun = vector(sun, 0)
    for i in range(whole(model.joint_count) + 1):
        axes, origin = load_frame(data.frame[i])
        u, s = transform_transposed(axes, air), transform_transposed(axes, to_sun)
        area, arm = 0.0, (0.0, 0.0, 0.0)
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(whole(surfaces.first[i]), whole(surfaces.first[i + 1])):
            plate = surfaces.plates[k]
            normal, centre = vector(plate, NORMAL), vector(plate, CENTRE)
            # a plate that faces away from the wind, or from the Sun, gets nothing
            facing = plate[DRAG_COEFFICIENT] * plate[AREA] * max(dot(normal, u), 0.0)
            area = area + facing
            arm = add(arm, scale(centre, facing))
            cosine = max(dot(normal, s), 0.0)
            lit = -pressure * plate[AREA] * cosine
            back = 2.0 * (plate[SPECULAR] * cosine + plate[DIFFUSE] / 3.0)
            push = add(scale(s, lit * (1.0 - plate[SPECULAR])), scale(normal, lit * back))
            force, moment = add(force, push), add(moment, cross(centre, push))
        against = scale(u, -0.5 * density)  # A (n . u) is in m3/s: u is a velocity here
        drag = _about_base(axes, origin, scale(against, area), cross(arm, against))
        shine = _about_base(axes, origin, force, moment)
        _add(drag, surfaces.drag)
        _add(shine, surfaces.sunlight)
        surfaces.wrench[i, :] = 0.0
        _add(drag, surfaces.wrench[i])
        _add(shine, surfaces.wrench[i])


@subroutine
def _about_base(
    axes: Matrix, origin: Vector, force: Vector, moment: Vector
) -> tuple[Vector, Vector]:
    """Return moment about the base's CoM and force, inertial axes, of a body's about its frame."""
    outer = transform(axes, force)
    return add(transform(axes, moment), cross(origin, outer)), outer


@subroutine
def _add(wrench: tuple[Vector, Vector], row: Array) -> None:
    store(add(vector(row, 0), wrench[0]), row, 0)
    store(add(vector(row, 3), wrench[1]), row, 3)


@kernel
def add_surface_wrenches(surfaces: Surfaces, model: Model, data: Data) -> None:
    """Add drag and sunlight to the bias forces of all bodies, which oppose the forces on them."""
    for i in range(whole(model.joint_count) + 1):
        wrench, bias = surfaces.wrench[i], data.bias[i]
        store(subtract(vector(bias, 0), vector(wrench, 0)), bias, 0)
        store(subtract(vector(bias, 3), vector(wrench, 3)), bias, 3)
