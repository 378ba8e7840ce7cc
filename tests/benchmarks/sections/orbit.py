"""Torques on a rigid satellite in orbit beside Basilisk's effectors; no time is measured.

The notes of the rows say what makes the models differ.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from space_robot.flight.plan import Flight, FlightPlan, resolve

from ..measure import Options
from ..peers.orbiting import SOURCES, Moment, Orbiting, OrbitPeer, OurSatellite, angle_apart
from ..result import Beside, Result, Target

Pair = tuple[Moment, Moment]

PERIOD = 0.05
"""s."""
FINER = 10
MINUTES, MINUTES_SHORT = 10, 2
ORBIT_S = 5553
"""An orbit at 400 km."""
PAPER_DEG = np.array([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
OMEGA = np.array([1e-3, -2e-3, 1.5e-3])
"""rad/s; in half a tick the satellite turns by 7e-5 rad."""
TORQUE = {
    "gravity gradient": (
        Target(5e-6),
        "Basilisk has 3 mu / r^3 u x I u, ours is a sum over bodies",
    ),
    "drag": (
        Target(1e-5),
        "air at the base here, at the whole's centre of mass there: m / scale height",
    ),
    "sunlight": (Target(2e-4), "Basilisk's Sun is 1 AU away: 2 R / AU of the pressure, R / AU rad"),
}
"""Largest difference as a share of the largest torque, and what makes it."""
ATTITUDE = {
    "gravity gradient": (Target(1e-6), ""),
    "drag": (Target(3e-5), "ours is held over a tick, Basilisk's is of every stage of the step"),
    "sunlight": (Target(3e-6), "as for drag and for the torque"),
    "all": (Target(3e-5), ""),
}
"""rad after ten minutes, in which gravity and drag each turn the satellite by 0.1 rad and more."""
TURNED = Target(1e-2)
"""rad; the least that all torques turn the satellite by: without them all fly alike."""


def orbit(options: Options) -> list[Result]:
    """Rows for each source alone, for all together, and for what Basilisk models otherwise."""
    from ..peers.basilisk_orbit import BasiliskSatellite

    minutes = MINUTES_SHORT if options.short else MINUTES
    robot = Flight(resolve(FlightPlan(duration=1.0))).plant.robot
    start = Orbiting(robot, PAPER_DEG, np.array([0.8, 0.36, -0.48, 0.0]), OMEGA, SOURCES, PERIOD)
    results = []
    for row, source in enumerate(SOURCES):
        options.progress(f"{source} beside Basilisk's")
        alone = replace(start, sources=(source,))
        ours = OurSatellite(alone)
        both = beside(ours, BasiliskSatellite(alone, ours), PERIOD, minutes)
        target, note = TORQUE[source]
        results += [
            _torque(f"{source}: torque apart", both, row, target, note),
            _attitude(source, both, minutes),
        ]
    results += _of_drag(replace(start, sources=("drag",)))
    options.progress("all of them beside Basilisk's")
    ours, free = OurSatellite(start), OurSatellite(replace(start, sources=()))
    both = beside(ours, BasiliskSatellite(start, ours), PERIOD, minutes)
    turned = angle_apart(
        both[-1][0].quaternion, free.fly(round(60.0 * minutes / PERIOD)).quaternion
    )
    results += [
        Result(
            f"all, {minutes} min: turned by them",
            "rad",
            (turned,),
            target=TURNED,
            better="more",
            is_condition=True,
        ),
        _attitude("all", both, minutes),
    ]
    return results if options.short else [*results, _shadow(start, options)]


def beside(ours: OrbitPeer, other: OrbitPeer, period: float, minutes: int) -> list[Pair]:
    """Fly both; what they tell after every minute."""
    ticks = round(60.0 / period)
    return [(ours.fly(ticks), other.fly(ticks)) for _ in range(minutes)]


def _of_drag(start: Orbiting) -> list[Result]:
    """What a tick's length and an air that stands still make of the difference of drag."""
    from ..peers.basilisk_orbit import BasiliskSatellite

    apart = []
    for period in (start.period, start.period / FINER):
        start = replace(start, period=period)
        ours = OurSatellite(start)
        both = beside(ours, BasiliskSatellite(start, ours), period, MINUTES_SHORT)
        apart.append(_largest_angle(both))
    ours = OurSatellite(start)
    still = beside(ours, BasiliskSatellite(start, ours, with_wind=False), start.period, 1)
    return [
        Result(
            f"drag: attitude apart, {MINUTES_SHORT} min, at {start.period * FINER * 1e3:g} ms",
            "rad",
            (apart[0],),
            Beside(f"at {start.period * 1e3:g} ms", (apart[1],)),
            note="of first order in the tick, but for the air's place",
        ),
        _torque("drag: torque apart where the air stands still", still, 1, None, "no wind told"),
    ]


def _torque(name: str, both: list[Pair], row: int, target: Target | None, note: str) -> Result:
    size = max(float(np.linalg.norm(ours.torques[row])) for ours, _ in both)
    apart = max(float(np.linalg.norm(a.torques[row] - b.torques[row])) for a, b in both)
    note = f"of {size:.3g} N m; {note}"
    return Result(name, "", (apart / size,), target=target, is_condition=bool(target), note=note)


def _attitude(what: str, both: list[Pair], minutes: int) -> Result:
    target, note = ATTITUDE[what]
    name, apart = f"{what}: attitude apart, {minutes} min", _largest_angle(both)
    return Result(name, "rad", (apart,), target=target, is_condition=True, note=note)


def _largest_angle(both: list[Pair]) -> float:
    return max(angle_apart(ours.quaternion, theirs.quaternion) for ours, theirs in both)


def _shadow(start: Orbiting, options: Options) -> Result:
    """Time in the Earth's shadow in an orbit: a cylinder here, cones of the Sun's width there."""
    from ..peers.basilisk_orbit import BasiliskSatellite

    options.progress("an orbit through the shadow beside Basilisk's")
    start = replace(start, sources=("sunlight",), period=1.0)
    ours = OurSatellite(start)
    theirs = BasiliskSatellite(start, ours)
    light = np.array([(ours.fly(1).light, theirs.fly(1).light) for _ in range(ORBIT_S)])
    dark = (1.0 - light).sum(axis=0)
    partial = int(((light[:, 1] > 0.0) & (light[:, 1] < 1.0)).sum())
    return Result(
        "shadow of an orbit",
        "s",
        (float(dark[0]),),
        Beside("basilisk", (float(dark[1]),)),
        note=f"Basilisk's is partial for {partial} s of it, ours never",
    )
