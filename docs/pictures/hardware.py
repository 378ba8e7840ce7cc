"""Pictures of sensors, joints, faults and missions in flight."""

from __future__ import annotations

import numpy as np
import theme
import yaml
from matplotlib.figure import Figure
from theme import BLUE, INK, MUTED, ORANGE

from space_robot import Scenario
from space_robot.analysis.errors import attitude_angles, relative_attitude, rotation_vectors
from space_robot_model.elementary.matrices import norms

ARCSEC = 3600.0


@theme.picture
def first_example() -> Figure:
    """Error and torque of the base in the first example of the page on Python."""
    log = Scenario(robot="paper", controller="tde_stc", case="3", sensors="fine").fly().log
    figure, (error, torque) = theme.panels(2, 4.6)
    theme.curves(error, log.time, dict(zip("xyz", 1e3 * attitude_angles(log).T, strict=True)))
    theme.curves(torque, log.time, dict(zip("xyz", log.applied_torque.T, strict=False)))
    error.set_ylabel("attitude, 10⁻³ deg")
    torque.set(xlabel="time, s", ylabel="base torque, N m")
    return figure


@theme.picture
def sensor_grades() -> Figure:
    """How far star tracker and base are off, by grade of sensors."""
    reported, pointed = {}, {}
    for grade in ("coarse", "tactical", "fine"):
        options = {"sensors": grade, "navigation": "filtered", "gains": "robust"}
        log = Scenario(**options, duration=10.0).fly().log
        off = rotation_vectors(relative_attitude(log.quaternion, log.measured.quaternion))
        reported[grade] = ARCSEC * np.degrees(norms(off))
        pointed[grade] = ARCSEC * norms(attitude_angles(log))
    figure, (tracker, base) = theme.panels(2, 5.2)
    theme.curves(tracker, log.time, reported)
    theme.curves(base, log.time, pointed)
    theme.powers(tracker.yaxis, base.yaxis)
    tracker.set(ylabel="star tracker\noff, arcsec", ylim=(1, 2e3))
    base.set(xlabel="time, s", ylabel="base off, arcsec", ylim=(1e-1, 2e3))
    return figure


@theme.picture
def reactions() -> Figure:
    """Torque on the base while all commands are lost from 1.0 to 1.3 s."""
    log = Scenario(faults=["drop_command@1-1.3"], duration=1.6).fly().log
    figure, (axes,) = theme.panels(height=3.4)
    theme.curves(axes, log.time[1600:3000], {"": log.applied_torque[1600:3000, 1]})
    for begin, word in ((0.8, "nominal"), (1.0, "holding"), (1.1, "safe"), (1.3, "nominal")):
        axes.axvline(begin, color=MUTED, linewidth=1.0, linestyle="--")
        axes.text(begin + 0.005, 2.75, word)
    axes.set(xlabel="time, s", ylabel="base torque y, N m", xlim=(0.8, 1.5), ylim=(-0.2, 3.0))
    return figure


@theme.picture
def segment() -> Figure:
    """Angle, rate and acceleration that guidance commands to joint 3 in case 1."""
    log = Scenario().fly().log
    figure, rows = theme.panels(3, 5.0, sharex=True)
    words = ("angle, deg", "rate, deg/s", "accel., deg/s²")
    for axes, word, values in zip(rows, words, log.reference_joints[:, :, 2].T, strict=True):
        theme.curves(axes, log.time, {"": np.degrees(values)})
        axes.set_ylabel(word)
    rows[-1].set_xlabel("time, s")
    return figure


@theme.picture
def panel_swing() -> Figure:
    """Angles of a solar panel's three hinges while the arm moves."""
    log = Scenario(robot="flexible_panels").fly().log
    figure, (axes,) = theme.panels(height=3.4)
    hinges = dict(zip(log.passive_names, np.degrees(log.passive_positions).T, strict=True))
    theme.curves(axes, log.time, {name: hinges[name] for name in log.passive_names[:3]})
    axes.set(xlabel="time, s", ylabel="hinge, deg")
    return figure


@theme.picture
def gear() -> Figure:
    """Motor and link with the spring between them, and how it bends on the page's robot."""
    robot = yaml.safe_load(theme.block("manual/gears.md", "geared.yaml"))
    log = Scenario(plant_robot=robot, controller="ctc_smc").fly().log
    figure, (sketch, plot) = theme.panels(2, 4.8, height_ratios=(0.9, 1.0))
    sketch.set(xlim=(0, 10), ylim=(0, 3), aspect="equal")
    sketch.axis("off")
    theme.box(sketch, (1.9, 1.5), "motor\nB = N² J", (2.6, 1.6), BLUE)
    theme.box(sketch, (8.1, 1.5), "link", (2.6, 1.6), ORANGE)
    zigzag = 1.95 + 0.3 * np.array([0, 0, *[1, -1] * 4, 0, 0, 0])
    sketch.plot(np.linspace(3.2, 6.8, 13), zigzag, color=INK)
    sketch.plot([3.2, 5.2, 5.2, 5.2], [0.95, 0.95, 1.2, 0.7], color=INK)
    sketch.plot([5.6, 4.8, 4.8, 5.6], [1.25, 1.25, 0.65, 0.65], color=INK)
    sketch.plot([5.6, 6.8], [0.95, 0.95], color=INK)
    sketch.text(5.0, 2.45, "spring K", ha="center")
    sketch.text(5.0, 0.1, "damper D", ha="center")
    bend = np.degrees(log.motor_positions[:, 0] - log.joint_positions[:, 0])
    theme.curves(plot, log.time, {"": ARCSEC * bend})
    plot.set(xlabel="time, s", ylabel="motor less link,\narcsec")
    return figure
