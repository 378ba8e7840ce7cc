"""Pictures of the base: its wheels, and where it points in an orbit."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import theme
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from robots import label, line
from theme import BLUE, GREEN, GRID, MUTED, ORANGE, PURPLE, WIDTH, Array

from space_robot import Scenario
from space_robot.flight.plan import Flight, resolve
from space_robot_control.allocation.settings import assumed_actuators
from space_robot_model.orbit.elements import EARTH_RADIUS
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.placements import base_axes


def facets(columns: Array) -> list[tuple[Array, Array]]:
    """Return normal and corners (4, 3) of each facet of the torques of wheels, exactly.

    ``columns`` (W, 3): axis times largest torque. Two wheels span a facet; on it the others give
    all that they have, in the sense of its normal.
    """
    sides = []
    for pair in combinations(range(len(columns)), 2):
        one, other = columns[[*pair]]
        for normal in (np.cross(one, other), np.cross(other, one)):
            centre = np.sign(np.delete(columns, pair, 0) @ normal) @ np.delete(columns, pair, 0)
            across, along = one + other, one - other
            corners = [centre + across, centre + along, centre - across, centre - along]
            sides.append((normal, np.array(corners)))
    return sides


@theme.picture
def wheels() -> Figure:
    """Envelopes of torque of both shipped wheel pyramids, and what case 1 asks of its base."""
    torque = Scenario().fly().log.applied_torque[::50, :3]
    figure = Figure(figsize=(WIDTH, 3.9))
    for place, name in zip(figure.subplots(1, 2), ("wheels", "small_wheels"), strict=True):
        settings = assumed_actuators(name, find_robot("paper")).wheels
        columns = settings.unit_axes * settings.values("max_torque")[:, None]
        sides = facets(columns)
        largest = max(np.max(torque @ normal) / (corners[0] @ normal) for normal, corners in sides)
        for _, corners in sides:
            line(place, corners[[0, 1, 2, 3, 0]], BLUE, 1.2)
        line(place, torque, ORANGE if largest > 1.0 else GREEN, 2.0)
        for number, axis in enumerate(columns, start=1):
            line(place, [0.0 * axis, axis], MUTED, 1.6)
            label(place, 1.25 * axis, f"{number}" if name == "wheels" else "", MUTED)
        title = f"{name}\n{settings.max_torque[0]:g} N m: {100 * largest:.0f} %"
        place.set(title=title, aspect="equal")
        place.axis("off")
    return figure


@theme.picture
def pointing() -> Figure:
    """The base's z axis along an orbit of `iss`, as guidance commands it, under three missions."""
    figure, axes = theme.drawing(10.0, 8.0)
    scale, centre = 3.0 / EARTH_RADIUS, np.array([5.0, 4.0])
    axes.add_patch(Circle((5.0, 4.0), 3.0, facecolor=GRID, edgecolor=MUTED))
    axes.text(5.0, 4.0, "Earth", ha="center", va="center")
    goals = {"nadir": BLUE, "inertial": ORANGE, "target": PURPLE}
    for row, (goal, color) in enumerate(goals.items()):
        base = {"point": goal} | ({"direction": [0, 0, 1]} if goal == "inertial" else {})
        segments = [{"base": base, "duration": 100}, {"hold": 5400}]
        mission = {"start": {"joints_deg": [0, 120, 220, 0, -10, 0]}, "segments": segments}
        events = ["capture@5450:neighbouring_satellite"] if goal == "target" else []
        flight = Flight(resolve(Scenario(orbit="iss", mission=mission, events=events)))
        places = flight.mission.ephemeris.motion(np.linspace(0.0, 5560.0, 241)).position
        plane = np.linalg.svd(places, full_matrices=False)[2][:2]
        if not row:
            axes.plot(*(scale * plane @ places.T + centre[:, None]), color=MUTED, linewidth=1.0)
        for node in range(10, 240, 20):
            tick = round(node * 5560.0 / 240 / flight.period)
            quaternion = flight.mission.chunk(tick, 1).base[0, :4]
            start = scale * plane @ places[node] + centre
            z = base_axes(quaternion[:, None])[2, :, 0]
            theme.arrow(axes, tuple(start), tuple(start + 0.95 * plane @ z), color=color)
        axes.text(0.1, 7.5 - 0.5 * row, goal, color=color)
    return figure
