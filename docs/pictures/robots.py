"""Pictures of robots in true geometry: the paper's, a capture, a tool on a line."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import theme
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from theme import BLUE, GREEN, GRID, MUTED, ORANGE, PURPLE, WIDTH, Array

from space_robot import Robot, Scenario
from space_robot.analysis.described import flown_robot
from space_robot.analysis.momentum import whole_momentum
from space_robot.analysis.tool_path import ToolPath
from space_robot_model.elementary.matrices import norm, norms
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import BASE_COLOUR, even_box, shapes_of
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.files import named_file
from space_robot_sim.environment.target import Target

VIEW = Rotation.from_euler("zx", (-28.0, -68.0), degrees=True).as_matrix()[:2]
"""From inertial axes to those of the picture: right and up."""


def line(axes: Axes, points: ArrayLike, color: str, width: float = 1.8, style: str = "-") -> None:
    """Draw a line through points in space (K, 3)."""
    axes.plot(*(VIEW @ np.array(points).T), style, color=color, linewidth=width)


def label(axes: Axes, point: Array, text: str, color: str, above: float = 0.0) -> None:
    """Write at a point in space, or above it."""
    x, y = VIEW @ point
    axes.text(x, y + above, text, color=color, ha="center", va="center")


def frame(axes: Axes, place: tuple[Array, Array], length: float, color: str, style: str) -> None:
    """Draw a frame's axes, by its origin and rotation, with their letters."""
    origin, rotation = place
    for axis, letter in zip(length * rotation.T, "xyz", strict=True):
        line(axes, [origin, origin + axis], color, 1.6, style)
        label(axes, origin + 1.17 * axis, letter, color)


def cuboid(axes: Axes, shape: Visual, place: tuple[Array, Array], color: str) -> None:
    """Draw the edges of a box that a body at a place carries."""
    origin, rotation = place
    corners = 0.5 * np.array(list(product((-1, 1), repeat=3))) * shape.size
    corners = origin + (corners @ shape.rotation.T + shape.position) @ rotation.T
    for first, second in combinations(range(8), 2):
        if (first ^ second).bit_count() == 1:
            line(axes, corners[[first, second]], color, 1.3)


class Pose:
    """Frames of all bodies of a robot at a row of a log, on inertial axes."""

    def __init__(self, robot: Robot, log: FlightLog, row: int) -> None:
        outer = base_axes(log.quaternion[row][:, None])
        frames = [*body_frames(robot, outer, log.joint_positions[row][:, None])]
        base = log.base_position[row]
        self.origins = np.array([body.origin[:, 0] + base for body in frames])
        self.rotations = [np.column_stack((body.x, body.y, body.z)) for body in frames]
        self.base = self.origins[0], self.rotations[0]
        self.tip = self.origins[-1] + self.rotations[-1] @ robot.tool.position
        self.tool = self.tip, self.rotations[-1] @ robot.tool.rotation
        self.box = shapes_of(robot)[0]

    def draw(self, axes: Axes, width: float, color: str = MUTED) -> None:
        """Draw the base's box, and the arm as lines between its joints."""
        cuboid(axes, self.box, self.base, color)
        line(axes, self.origins[:2], GRID, width)
        line(axes, [*self.origins[1:], self.tip], color, width)


@theme.picture
def robot() -> Figure:
    """The paper's robot after 15 s of free floating: bodies, joint axes, frames."""
    log = Scenario(actuators="none", duration=15.0).fly().log
    pose = Pose(flown_robot(log), log, -1)
    figure, axes = theme.drawing(6.0, 5.2)
    pose.draw(axes, 6.0)
    sides = (0.75, -0.6, 0.62, -0.7, 0.62, 0.35)  # of the numbers, so that none is on another
    for number, side in enumerate(sides, start=1):
        origin, z = pose.origins[number], pose.rotations[number][:, 2]
        line(axes, [origin - 0.45 * z, origin + 0.55 * z], ORANGE, 2.2)
        label(axes, origin + side * z, f"{number}", ORANGE, 0.17 * (number in (4, 6)))
    frame(axes, (np.zeros(3), np.eye(3)), 1.45, BLUE, "--")
    frame(axes, pose.base, 1.1, GREEN, "-")
    frame(axes, pose.tool, 0.7, PURPLE, "-")
    words = {"inertial": BLUE, "base_link": GREEN, "joint axes 1 to 6": ORANGE, "tool": PURPLE}
    for row, (word, color) in enumerate(words.items()):
        axes.text(2.0, 0.25 + 0.42 * row, word, color=color)
    for joint, place, angle in ((2, (-1.15, 2.3), -70), (3, (0.35, 3.05), 9)):
        length = norm(pose.origins[joint + 1] - pose.origins[joint])
        axes.text(*place, f"{length:.2f} m", color=MUTED, rotation=angle)
    axes.set(xlim=(-1.9, 4.1), ylim=(-1.1, 4.5))
    return figure


@theme.picture
def capture_sequence() -> Figure:
    """Case 1 with a capture at 15 s: the robot before, at and after it, and its momentum."""
    log = Scenario(events=["capture@15:tumbling_satellite"]).fly().log
    target = Target.from_yaml(named_file("targets", "tumbling_satellite"))
    shape = even_box(target.mass, inertia_tensor(target.inertia), np.zeros(3), 0, BASE_COLOUR)
    robot, period = flown_robot(log), log.timebase.period
    grasp, motion = Pose(robot, log, round(15.0 / period)), target.motion
    figure = Figure(figsize=(WIDTH, 5.6))
    times = {"at 5 s": 5.0, "grasp, 15 s": 15.0, "at 30 s": 30.0}
    places = figure.subplot_mosaic([[*times], ["plot"] * 3], height_ratios=(1.3, 1.0))
    for word, time in times.items():
        sketch, pose = places[word], Pose(robot, log, round(time / period) - 1)
        pose.draw(sketch, 4.0)
        before = min(time - 15.0, 0.0)  # until the grasp the target moves freely
        tip, rotation = grasp.tool if before else pose.tool
        centre = tip + rotation @ target.place.position + before * np.array(motion.velocity)
        turn = Rotation.from_rotvec(before * np.array(motion.angular_velocity)).as_matrix()
        cuboid(sketch, shape, (centre, turn @ rotation @ target.rotation), ORANGE)
        sketch.set(title=word, xlim=(-1.5, 3.6), ylim=(-1.5, 6.3), aspect="equal")
        sketch.axis("off")
    momentum, plot = whole_momentum(log), places["plot"]
    parts = {"base": momentum.base, "arm and target": momentum.robot - momentum.base}
    theme.curves(plot, log.time, {name: norms(values) for name, values in parts.items()})
    plot.axvline(15.0, color=MUTED, linestyle="--")
    plot.set(xlabel="time, s", ylabel="momentum, N m s")
    return figure


@theme.picture
def tool_line() -> Figure:
    """The tool's straight line, first and last pose, and how far the base and the tool stray."""
    log = Scenario(mission="line", controller="ctc").fly().log
    figure = Figure(figsize=(WIDTH, 3.8))
    sketch, plot = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    first, last = (Pose(flown_robot(log), log, row) for row in (0, -1))
    first.draw(sketch, 4.0)
    last.draw(sketch, 4.0, BLUE)
    line(sketch, [first.tip, last.tip], ORANGE, 3.0)
    sketch.set_aspect("equal")
    sketch.axis("off")
    error = ToolPath(log).errors(0, log.ticks)[:, 0]
    drift = norms(log.base_position - log.base_position[0])
    theme.curves(plot, log.time, {"base moved": drift, "tool off": error})
    theme.powers(plot.yaxis)
    plot.set(xlabel="time, s", ylabel="m", ylim=(1e-8, 1.0))
    return figure
