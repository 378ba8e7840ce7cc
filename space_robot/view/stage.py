"""Environment of the robots in a scene: stars, inertial axes, lights, initial camera."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError

from .horizon import Horizon
from .mesh import Mesh
from .meshes import shown_shapes

if TYPE_CHECKING:
    from viser import DirectionalLightHandle, SceneApi, ViserServer

Array = NDArray[np.float64]

FIELD_OF_VIEW = np.radians(35.0)
DIRECTION = np.array([0.62, -1.0, 0.42])
"""Direction from the robots to the initial camera; robots are side by side along x."""
SIDES = np.array([[x, y, z] for z in (1.0, -1.0) for y in (1.0, -1.0) for x in (1.0, -1.0)])
"""(8, 3) signs of the direction: the initial camera's possible places, the usual one first."""
SKY = 1.4
LAMPS = (((0.2, -0.7, 1.0), 2.3), ((-0.8, -0.6, 0.3), 0.6))
"""Directions and intensities of the lights."""
STARS, STAR_SEED = 500, 1
STARS_AT, STAR = 40.0, 0.0025
"""Distance of the stars relative to the size of the scene, and their size relative to that."""
STAR_DARK, STAR_LIGHT = (130, 136, 150), (205, 209, 216)
"""Colours of the stars on dark and on light pages."""
DISTANCE = 3000.0
"""Distance of the Earth's centre relative to the size of the scene."""
BEHIND = 2.0
"""Distance of the stars in orbit relative to that."""
IN_SHADOW = 0.12
"""Intensity of the Sun's light in the Earth's shadow, relative to that outside: none would hide
the robot."""
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def check_viser() -> None:
    """Check that viser is installed.

    Raises:
        InputError: it is not installed.
    """
    if find_spec("viser") is None:
        raise InputError(f"view needs viser: {install_command('view')}")


class Stage(NamedTuple):
    """A scene without robots."""

    middle: Array
    """(3,) m, inertial frame."""
    size: float
    """m."""
    earth_distance: float
    """Largest distance of the Earth's centre in orbit, m."""
    lamp: DirectionalLightHandle
    """The brightest light, the Sun in orbit."""

    def shade(self, is_dark: bool) -> None:
        """Dim the brightest light in the Earth's shadow."""
        intensity = LAMPS[0][1] * (IN_SHADOW if is_dark else 1.0)
        if self.lamp.intensity != intensity:
            self.lamp.intensity = intensity


def set_stage(
    server: ViserServer,
    points: Array,
    dark: bool,
    horizon: Horizon | None = None,
    side: Array = SIDES[0],
) -> Stage:
    """Add stars, axes, lights and the initial camera for some points.

    Args:
        server: of the scene.
        points: (K, 3) that must be visible, m, inertial frame.
        dark: whether the page is light on dark.
        horizon: of a scene in orbit.
        side: (3,) of `SIDES`, where camera and lights are.
    """
    scene, camera = server.scene, server.initial_camera
    axes = horizon.axes if horizon else np.eye(3)
    back = axes.T @ camera_direction(side, horizon)
    scene.set_up_direction(axes[:, 2] if horizon else "+z")
    scene.world_axes.visible = False
    points = points @ axes
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 0.1)
    earth_at = DISTANCE * size
    stars_at = BEHIND * earth_at if horizon else STARS_AT * size
    far = 2.0 * stars_at if horizon else 100.0 * size
    corner = low - 0.05 * size
    if horizon:
        corner[2] = middle[2]  # above the Earth
        points = np.vstack([points, corner])
    _inertial_axes(scene, size, axes @ corner)
    _stars(scene, axes @ middle, stars_at, dark, "float32" if horizon else "float16")
    lamp = _light(scene, axes * side, horizon.sun if horizon else None)
    camera.fov, camera.near, camera.far = float(FIELD_OF_VIEW), 0.01 * size, far
    if horizon or camera.up is not None:  # that of a flight before
        camera.up = axes[:, 2]
    camera.look_at = axes @ middle
    camera.position = axes @ (middle + _distance(points - middle, back) * back)
    return Stage(axes @ middle, size, earth_at, lamp)


def camera_direction(side: Array, horizon: Horizon | None) -> Array:
    """Return the unit vector (3,) from the robots to the initial camera, inertial axes.

    Args:
        side: (3,) of `SIDES`.
        horizon: of a scene in orbit, whose camera is above the horizon on every side.
    """
    direction = DIRECTION * side
    if horizon:
        return np.asarray(horizon.axes @ horizon.camera_direction(direction, FIELD_OF_VIEW))
    return np.asarray(direction / np.linalg.norm(direction))


def _inertial_axes(scene: SceneApi, size: float, corner: Array) -> None:
    """Draw inertial axes of a round length, which make drift and rotation visible."""
    length = 10.0 ** np.floor(np.log10(0.5 * size))
    scene.add_frame(
        "/inertial",
        axes_length=length,
        axes_radius=0.002 * size,
        origin_radius=0.004 * size,
        position=corner,
    )
    scene.add_label("/inertial/length", f"{length:g} m", position=(length, 0.0, 0.0))


def _stars(
    scene: SceneApi,
    middle: Array,
    distance: float,
    dark: bool,
    precision: Literal["float16", "float32"],
) -> None:
    """Draw stars, which make rotation visible; numbers of 16 bits end at 65,504 m."""
    directions = unit_rows(np.random.default_rng(STAR_SEED).normal(size=(STARS, 3)))
    scene.add_point_cloud(
        "/stars",
        middle + distance * directions,
        STAR_DARK if dark else STAR_LIGHT,
        point_size=STAR * distance,
        point_shape="circle",
        precision=precision,
    )


def _light(scene: SceneApi, axes: Array, sun: Array | None) -> DirectionalLightHandle:
    """Add lights instead of viser's environment map, which may load late or not at all."""
    scene.configure_environment_map(None)
    scene.configure_default_lights(False)
    scene.add_light_hemisphere("/sky", ground_color=(110, 112, 125), intensity=SKY)
    lamps = []
    for number, (place, strength) in enumerate(LAMPS):
        direction = axes @ place if sun is None or number else sun
        turn, _ = Rotation.align_vectors([direction], [[0.0, 0.0, 1.0]])
        lamps.append(
            scene.add_light_directional(
                f"/lamp_{number}",
                color=(255, 250, 240),
                intensity=strength,
                position=tuple(direction),
                cast_shadow=number == 0,
                wxyz=quaternion_of_rotation(turn.as_matrix()),
            )
        )
    return lamps[0]


def _distance(points: Array, back: Array) -> float:
    """Return the camera's distance from the origin, m, that shows all points in portrait format."""
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    slope = np.tan(0.5 * FIELD_OF_VIEW)
    aside = np.maximum(np.abs(points @ right) / 1.1, np.abs(points @ up))
    return 1.12 * float(np.max(points @ back + aside / slope))


def extent(robot: Robot, position: Array, quaternion: Array, joint_positions: Array) -> Array:
    """Return the corners of a robot's shapes in some poses, (K, 3) m, inertial frame.

    Args:
        robot: with its visuals.
        position: (T, 3) of the base, m.
        quaternion: (T, 4) of the base.
        joint_positions: (T, N) of all joints, rad or m.
    """
    axes = base_axes(quaternion.T)
    frames = {f.body: f for f in body_frames(robot, axes, joint_positions.T)}
    corners = []
    drawn = shown_shapes(robot)
    for shape in drawn.shapes:
        frame = frames[shape.body]
        for corner in shape_corners(shape, drawn.meshes.get(shape.mesh)):
            place = frame.on_outer_axes(shape.position + shape.rotation @ corner)
            corners.append(position + (frame.origin + place).T)
    return np.concatenate(corners)


def body_reach(robot: Robot, body: int) -> float:
    """Return the largest distance, m, of a body's shapes from its frame's origin; 0 without."""
    drawn = shown_shapes(robot)
    corners = [
        shape.position + shape_corners(shape, drawn.meshes.get(shape.mesh)) @ shape.rotation.T
        for shape in drawn.shapes
        if shape.body == body
    ]
    return float(np.linalg.norm(np.concatenate(corners), axis=1).max()) if corners else 0.0


def shape_corners(shape: Visual, mesh: Mesh | None) -> Array:
    """Return the corners of a shape's bounding box, (8, 3) m, in the shape's axes."""
    size = np.array(shape.size)
    middle = np.zeros(3)
    if mesh is not None:
        low, high = mesh.vertices.min(axis=0) * size, mesh.vertices.max(axis=0) * size
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
    elif shape.shape == "box":
        half = 0.5 * size
    elif shape.shape == "cylinder":
        half = np.array([size[0], size[0], 0.5 * size[1]])
    else:
        half = np.full(3, size[0])
    corners: Array = middle + CORNERS * half
    return corners
