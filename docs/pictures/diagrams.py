"""Block diagrams: the loop and the navigation, with names and rates of the product."""

from __future__ import annotations

import theme
from matplotlib.figure import Figure
from theme import BLUE, GREEN, MUTED, ORANGE

from space_robot import Scenario
from space_robot.flight.plan import resolve
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.hardware.sheets import read_sheet
from space_robot_msgs_py import topics

RATE = f"{1.0 / resolve(Scenario()).plant.period:,.0f} Hz"


@theme.picture
def loop() -> Figure:
    """One tick: plant, sensors, navigation, law, allocation, actuators, with their topics."""
    figure, axes = theme.drawing(10.0, 8.0)
    for x, y, name, color in (
        (5.0, 7.35, "guidance", GREEN),
        (1.4, 5.0, "navigation", BLUE),
        (5.0, 5.0, "law", BLUE),
        (8.6, 5.0, "allocation", BLUE),
        (5.0, 3.15, "delay δ = 1 tick", BLUE),
        (1.4, 0.7, "sensors", ORANGE),
        (5.0, 0.7, "plant", ORANGE),
        (8.6, 0.7, "actuators", ORANGE),
    ):
        theme.box(axes, (x, y), name, (2.8 if x == 5.0 else 2.35, 1.1), color)
    theme.arrow(axes, (5.0, 6.8), (5.0, 5.55))
    theme.arrow(axes, (2.58, 5.0), (3.6, 5.0))
    theme.arrow(axes, (6.4, 5.0), (7.42, 5.0))
    theme.arrow(axes, (1.4, 4.45), (1.4, 3.15), (3.6, 3.15))
    theme.arrow(axes, (5.0, 3.7), (5.0, 4.45))
    theme.arrow(axes, (8.6, 4.45), (8.6, 1.25))
    theme.arrow(axes, (7.42, 0.7), (6.4, 0.7))
    theme.arrow(axes, (3.6, 0.7), (2.58, 0.7))
    theme.arrow(axes, (0.6, 1.25), (0.6, 4.45))
    references = f"{topics.REFERENCE_JOINTS.full_name}\n{topics.REFERENCE_BASE.full_name}"
    states = f"{topics.JOINT_STATES.full_name}\n{topics.BASE_STATE.full_name}\n{RATE}"
    axes.text(5.2, 6.15, references, color=MUTED, va="center")
    axes.text(0.75, 2.05, states, color=MUTED, va="center")
    axes.text(8.45, 2.6, f"{topics.COMMAND.full_name}\n{RATE}", color=MUTED, ha="right")
    axes.text(5.0, 2.2, "force, acceleration\nof the last tick", color=MUTED, ha="center", va="top")
    return figure


@theme.picture
def filters() -> Figure:
    """The filters between sensors and law, with the rates and delays of `fine` sensors."""
    filters = NavigationFilterSettings()
    tracker = read_sheet(SensorSettings, "sensors", "fine").star_tracker
    figure, axes = theme.drawing(10.0, 7.4)
    late = f"{tracker.rate:g} Hz, {tracker.delay:g} s late"
    for y, source, stage, estimate in (
        (6.6, f"star tracker\n{late}", "Kalman filter:\nattitude, gyro bias", "attitude"),
        (4.7, f"gyro\n{RATE}", f"low-pass, twice\n{filters.rate_filter_hz:g} Hz", "base rate"),
        (2.6, f"encoders\n{RATE}", f"Kalman filter\n{filters.joint_bandwidth_hz:g} Hz", "joints"),
        (0.8, "applied torque", "the same lags", "torque"),
    ):
        theme.box(axes, (1.6, y), source, (3.0, 1.25), ORANGE)
        theme.box(axes, (6.0, y), stage, (3.4, 1.25), BLUE)
        theme.arrow(axes, (3.1, y), (4.3, y))
        theme.arrow(axes, (7.7, y), (8.3, y))
        axes.text(8.35, y, estimate, va="center")
    theme.arrow(axes, (3.7, 4.7), (3.7, 6.2), (4.3, 6.2))
    theme.arrow(axes, (6.0, 5.97), (6.0, 5.33))
    axes.text(6.2, 5.65, "bias", color=MUTED, va="center")
    return figure
