"""What is around the robots of a scene: stars, inertial axes, lights, and the initial camera."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError

from .orbit import OrbitFrames
from .shapes import BaseSurface, bounding_boxes

if TYPE_CHECKING:
    from viser import DirectionalLightHandle, SceneApi, ViserServer

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
DISTANCE, BEHIND = 3000.0, 2.0
"""Distance of the Earth's centre relative to the size of the scene, and of the stars in orbit
relative to that."""
IN_SHADOW = 0.12
"""Intensity of the Sun's light in the Earth's shadow, relative to that outside: none would hide
the robot."""
LIMB = 0.6
"""Distance of the Earth's limb below the middle of the first picture, relative to half of it."""
STEEPEST = np.radians(30.0)
"""Largest elevation of the initial camera in orbit."""
MOST_HIDDEN = 0.25
"""Share of the arms that the base may hide from the initial camera."""
NEAR_LARGEST = 0.8
"""Seen area of a robot from the initial camera, relative to that from the best of `SIDES`."""


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
    orbit: OrbitFrames | None = None,
    side: Array = SIDES[0],
) -> Stage:
    """Add stars, axes, lights and the initial camera, to which all points are visible.

    The ``points`` (K, 3) are in m, inertial frame; camera and lights are on a ``side`` (3,) of
    `SIDES`.
    """
    scene, camera = server.scene, server.initial_camera
    axes = orbit.axes if orbit else np.eye(3)
    back = axes.T @ camera_direction(side, orbit)
    scene.set_up_direction(axes[:, 2] if orbit else "+z")
    scene.world_axes.visible = False
    points = points @ axes
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 0.1)
    earth_at = DISTANCE * size
    stars_at = BEHIND * earth_at if orbit else STARS_AT * size
    length = 10.0 ** np.floor(np.log10(0.5 * size))
    corner = low - 0.05 * size
    if side[1] < 0.0:  # the camera is behind: this corner is the left one there
        corner[:2] = high[:2] + 0.05 * size - length
    if orbit:
        corner[2] = middle[2]  # above the Earth
        points = np.vstack([points, corner])
    _add_inertial_axes(scene, size, length, axes @ corner)
    directions = unit_rows(np.random.default_rng(STAR_SEED).normal(size=(STARS, 3)))
    scene.add_point_cloud(  # makes rotation visible
        "/stars",
        axes @ middle + stars_at * directions,
        STAR_DARK if dark else STAR_LIGHT,
        point_size=STAR * stars_at,
        point_shape="circle",
        precision="float32" if orbit else "float16",  # 16 bits end at 65,504 m
    )
    lamp = _add_lights(scene, axes * side, orbit.sun if orbit else None)
    far = 2.0 * stars_at if orbit else 100.0 * size
    camera.fov, camera.near, camera.far = float(FIELD_OF_VIEW), 0.01 * size, far
    if orbit or camera.up is not None:  # that of a flight before
        camera.up = axes[:, 2]
    camera.look_at = axes @ middle
    camera.position = axes @ (middle + _distance(points - middle, back) * back)
    return Stage(axes @ middle, size, earth_at, lamp)


def camera_direction(side: Array, orbit: OrbitFrames | None) -> Array:
    """Return the unit vector (3,) from the robots to the initial camera, inertial axes.

    In orbit the camera is above the horizon on each ``side``, and the limb in its lower half.
    """
    direction = DIRECTION * side
    if orbit is None:
        return np.asarray(direction / np.linalg.norm(direction))
    elevation = np.clip(orbit.dip - LIMB * 0.5 * FIELD_OF_VIEW, 0.0, STEEPEST)
    aside = direction[:2] / np.linalg.norm(direction[:2])
    return np.asarray(orbit.axes @ [*np.cos(elevation) * aside, np.sin(elevation)])


def _add_inertial_axes(scene: SceneApi, size: float, length: float, corner: Array) -> None:
    """Draw inertial axes of a round length, which make drift and rotation visible."""
    scene.add_frame(
        "/inertial",
        axes_length=length,
        axes_radius=0.002 * size,
        origin_radius=0.004 * size,
        position=corner,
    )
    scene.add_label("/inertial/length", f"{length:g} m", position=(length, 0.0, 0.0))


def _add_lights(scene: SceneApi, axes: Array, sun: Array | None) -> DirectionalLightHandle:
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


def clearest_side(
    flights: Sequence[tuple[Robot, Array, Array]], orbit: OrbitFrames | None = None
) -> Array:
    """Return the first of `SIDES` where the base hides at most `MOST_HIDDEN` of the arms.

    Sides where much of the robot is seen, panels not from their edges, come first. If there is no
    such side it is the one where the base hides least. The flights are robots with the attitudes
    (T, 4) of their bases and the positions (T, N) of all their joints, rad or m.
    """
    directions = np.array([camera_direction(side, orbit) for side in SIDES])
    areas = np.sum([_seen_areas(*flight, directions) for flight in flights], axis=0)
    order = np.argsort(areas < NEAR_LARGEST * areas.max(), kind="stable")
    shares = []
    for direction in directions[order]:
        shares.append(float(np.mean([_hidden_share(*flight, direction) for flight in flights])))
        if shares[-1] <= MOST_HIDDEN:
            break
    return np.asarray(SIDES[order[int(np.argmin(shares))]])


def _seen_areas(
    robot: Robot, quaternion: Array, joint_positions: Array, directions: Array
) -> Array:
    """Return the mean areas, m2, of a robot's boxes from some directions (D, 3)."""
    frames = {
        frame.body: frame
        for frame in body_frames(robot, base_axes(quaternion.T), joint_positions.T)
    }
    areas = np.zeros(len(directions))
    for box in bounding_boxes(robot):
        for axis, normal in enumerate(box.shape.rotation.T):
            face = 4.0 * float(np.prod(np.delete(box.half, axis)))
            seen = directions @ frames[box.shape.body].on_outer_axes(normal)
            areas += face * np.abs(seen).mean(axis=1)
    return areas


def _hidden_share(
    robot: Robot, quaternion: Array, joint_positions: Array, direction: Array
) -> float:
    """Return the share of actuated joints and tools that the base hides in a direction (3,)."""
    surface, still = BaseSurface(robot), np.eye(3)[:, :, np.newaxis]
    frames = {f.body: f for f in body_frames(robot, still, joint_positions.T)}
    points = [frames[joint + 1].origin for joint in range(robot.n)]
    points += [
        frames[tool.body].origin + frames[tool.body].on_outer_axes(tool.position)
        for tool in robot.tools
    ]
    hidden = [
        surface.distance(point[:, k], axes @ direction) > 1e-3
        for k, axes in enumerate(np.moveaxis(base_axes(quaternion.T), 2, 0))
        for point in (np.broadcast_to(p, (3, len(quaternion))) for p in points)
    ]
    return float(np.mean(hidden))
