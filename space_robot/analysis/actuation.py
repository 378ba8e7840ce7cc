"""Settling, and metrics of commands, joints and wheels: limits reached, latency, lateness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .described import NO_LIMITS
from .errors import joined_error, measured_rows, waypoint_ticks
from .series import Definition, TimeSeries, largest_sizes, metrics, series

BAND = 1e-5
"""Largest |error| that counts as settled: rad or m on a joint; on eps, which is 4.1 arcsec."""
SHORTEST_WATCH = 0.1
"""s of flight after a waypoint without which nothing can be said of settling there."""
STANDING = 0.01
"""Share of the desired velocity below which a joint stands."""
ROUNDING = 1e-9
"""rad or m of a position, share of other limits, by which a number at its limit may miss it."""
LONG_STANDING = 0.05
"""Least share of its way on which a joint stands that is worth a remark."""
LEAST_WAY = 1e-3
"""Way, rad or m, from which on it is of interest whether a joint stands."""
PERCENTILES = {"p50": 50.0, "p99": 99.0, "max": 100.0}
LIMIT_KINDS = ("position", "velocity", "effort")
"""Limits of joints in the robot's file."""


@metrics(
    "settling",
    {
        "{error}.settling": Definition(
            "s",
            "time from the last waypoint after which the error stays to the end within "
            f"{BAND:g} rad or m on joints, and 4.1 arcsec of the attitude's error on each axis",
        ),
        "settling.after": Definition("s", "time of the waypoint from which settling counts"),
    },
)
def settling(flight: AnalysedLog) -> dict[str, float]:
    """Compute the time from which each error column stays in `BAND`; inf: outside at the end.

    As in control engineering (e.g. Ogata, Modern Control Engineering, 5-3), with a band in
    absolute terms: a tracking error has no final value to take a share of. The last waypoint of the
    paper's mission is its last tick, so that the one at 15 s is taken.
    """
    log, period = flight.log, flight.log.timebase.period
    rows = waypoint_ticks(log)
    watched = rows[rows <= log.ticks - round(SHORTEST_WATCH / period)]
    if not len(watched):
        raise InputError("the arm does not come to rest with flight left after it")
    waypoint = int(watched[-1])
    last = dict.fromkeys(flight.error_columns, waypoint - 1)
    for start, stop in flight.blocks():
        error = joined_error(log.rows(start, stop), flight.attitude_errors(start, stop))
        for name, axes in flight.error_columns.items():
            outside = largest_sizes(error[:, axes]) > BAND
            if outside.any():
                row = start + len(outside) - 1 - int(np.argmax(outside[::-1]))
                last[name] = max(last[name], row)
    numbers = {"settling.after": (log.first_tick + waypoint) * period}
    for name, row in last.items():
        is_settled = row < log.ticks - 1
        numbers[f"{name}.settling"] = (row + 1 - waypoint) * period if is_settled else np.inf
    return numbers


@metrics(
    "saturation",
    {
        "torque_limits.ticks": Definition("ticks", "ticks with a reported torque at its limit"),
        "torque_limits.share": Definition("share", "share of these ticks"),
        "torque_limits.base": Definition("N m", "limit of the base's torque; missing: none"),
        "torque_limits.joints": Definition("N m", "limit of the joints' torques; missing: none"),
    },
    applies=lambda flight: bool(np.isfinite(flight.torque_limits).any()),
)
def saturation(flight: AnalysedLog) -> dict[str, float]:
    """Count the ticks at which the torque applied on some axis was at its limit.

    The plant clips to the limit, so "at" is exact but for the rounding of whoever recorded. It is
    the torque as reported, behind the limits and before what the drives make of it.
    """
    limits, log = flight.torque_limits, flight.log.as_measured()
    limit = limits.each_axis(log.axes) * (1.0 - ROUNDING)

    def count(start: int, stop: int) -> int:
        at_limit = np.abs(log.applied_torque[start:stop]) >= limit
        return int(np.count_nonzero(at_limit.any(axis=1)))

    ticks = float(flight.sum_up(count))
    numbers = {"torque_limits.ticks": ticks, "torque_limits.share": ticks / log.ticks}
    known = {"torque_limits.base": limits.base, "torque_limits.joints": limits.joint}
    return numbers | {name: limit for name, limit in known.items() if np.isfinite(limit)}


@metrics(
    "saturation",
    {
        "wheels.saturation": Definition("share", "share of the ticks with any wheel at a limit"),
        "wheels.saturation_ticks": Definition("ticks", "these ticks"),
        "{wheel}.torque_limit_ticks": Definition("ticks", "ticks at the motor's largest torque"),
        "{wheel}.momentum_limit_ticks": Definition("ticks", "ticks at the largest momentum"),
        "{wheel}.first_limit": Definition("s", "when the wheel was first at a limit"),
    },
    applies=lambda flight: flight.log.wheel_velocities.shape[1] > 0,
)
def wheel_saturation(flight: AnalysedLog) -> dict[str, float]:
    """Count the ticks at which each wheel's motor gave all it can, or its wheel was full."""
    log, wheels = flight.log, flight.actuators.wheels
    limits = np.array([wheels.limits("max_torque"), wheels.limits("max_momentum")])

    def compare(start: int, stop: int) -> NDArray[np.bool_]:
        motion = np.stack(wheel_motion(log, start, stop, wheels), axis=1)
        return np.abs(motion) >= limits * (1.0 - ROUNDING)

    at_limit: NDArray[np.bool_] = np.concatenate([compare(*rows) for rows in flight.blocks()])
    at_either: NDArray[np.bool_] = np.logical_or.reduce(at_limit, axis=1)
    ticks = np.count_nonzero(at_limit, axis=0)
    any_ticks = float(np.count_nonzero(at_either.any(axis=1)))
    numbers = {"wheels.saturation": any_ticks / log.ticks, "wheels.saturation_ticks": any_ticks}
    for i, name in enumerate(flight.parts("wheel")):
        numbers[f"{name}.torque_limit_ticks"] = float(ticks[0, i])
        numbers[f"{name}.momentum_limit_ticks"] = float(ticks[1, i])
        if at_either[:, i].any():
            first = log.first_tick + int(np.argmax(at_either[:, i]))
            numbers[f"{name}.first_limit"] = first * log.timebase.period
    return numbers


@metrics(
    "saturation",
    {"{wheel}.reversals": Definition("1/s", "how often the wheel's sense of rotation changes")},
    applies=lambda flight: flight.log.wheel_velocities.shape[1] > 0,
)
def wheel_reversals(flight: AnalysedLog) -> dict[str, float]:
    """Count the passages of each wheel through standstill, where friction is worst."""
    log = flight.log

    def count(start: int, stop: int) -> NDArray[np.intp]:
        sense = np.sign(log.wheel_velocities[max(start - 1, 0) : stop])
        changes: NDArray[np.intp] = np.count_nonzero(sense[1:] * sense[:-1] < 0.0, axis=0)
        return changes

    rates = flight.sum_up(count) / (log.ticks * log.timebase.period)
    return {f"{n}.reversals": float(r) for n, r in zip(flight.parts("wheel"), rates, strict=True)}


def wheel_motion(
    log: FlightLog, start: int, stop: int, wheels: WheelSettings
) -> tuple[Array, Array]:
    """Return what the motors gave up to some rows, and where they brought the wheels, (N, W) each.

    The torque, N m, over the interval that ended at the tick, and the momentum, N m s, that the
    wheel would have by then without friction. A motor stops at its wheel's limit whatever friction
    takes, and whatever the base does meanwhile: ``h + u T`` is what it looks at.
    """
    before = max(start - 1, 0)
    momentum, torque = wheels.spin_momenta(log.wheel_velocities[before:stop]), log.wheel_torques
    if start == 0:
        momentum = np.concatenate([momentum[:1], momentum])
    reached = momentum[:-1] + torque[start:stop] * log.timebase.period
    if start == 0:  # the interval before the first row is not of this flight
        reached[0] = momentum[0]
    return torque[start:stop], reached


@metrics(
    "joints",
    {
        "{joint}.standing": Definition(
            "share", "share of the way that the joint is to move on which friction holds it"
        )
    },
)
def standing(flight: AnalysedLog) -> dict[str, float]:
    """Compute the share of its way on which each joint stands; of joints that are to move.

    A joint stands at a tick at which it is slower than `STANDING` of the desired velocity. Ticks
    count by the desired velocity, so that a joint that starts a little late counts for little.
    """
    log = flight.log

    def ways(start: int, stop: int) -> Array:
        desired = np.abs(log.reference_joints[start:stop, 1])
        stands = np.abs(log.joint_velocities[start:stop]) < STANDING * desired
        return np.array([np.sum(desired, axis=0), np.sum(desired, axis=0, where=stands)])

    way, held = flight.sum_up(ways)
    return {
        f"{name}.standing": float(held[k] / way[k])
        for k, name in enumerate(log.joint_names)
        if way[k] * log.timebase.period >= LEAST_WAY
    }


@metrics(
    "joints",
    {
        f"{{joint}}.beyond_{kind}": Definition(
            "ticks", f"ticks beyond the {kind} of the robot's file"
        )
        for kind in LIMIT_KINDS
    },
)
def beyond_limits(flight: AnalysedLog) -> dict[str, float]:
    """Count the ticks at which each joint was beyond the limits of the robot's file.

    The plant has no end stops, and does not limit velocity and effort by that file.
    """
    log, joints = flight.log, flight.log.joint_names
    limits: Array = np.array(flight.robot.limits[: len(joints)]).reshape(len(joints), 4).T
    lower, upper, velocity, effort = limits
    if not np.isfinite(limits).any():
        return {}

    def count(start: int, stop: int) -> NDArray[np.intp]:
        position = log.joint_positions[start:stop]
        beyond = (
            np.maximum(position - upper, lower - position) > ROUNDING,
            np.abs(log.joint_velocities[start:stop]) > velocity * (1.0 + ROUNDING),
            np.abs(log.applied_torque[start:stop, 3:]) > effort * (1.0 + ROUNDING),
        )
        ticks: NDArray[np.intp] = np.count_nonzero(beyond, axis=1)
        return ticks

    ticks = flight.sum_up(count)
    return {
        f"{name}.beyond_{kind}": float(ticks[row, k])
        for k, name in enumerate(joints)
        if np.isfinite(limits[:, k]).any()
        for row, kind in enumerate(LIMIT_KINDS)
    }


@metrics(
    "joints",
    {
        "{joint}.effort_used": Definition(
            "share", "largest effort, of the limit in the robot's file"
        )
    },
)
def effort_used(flight: AnalysedLog) -> dict[str, float]:
    """Return the share of its effort limit that each joint needed; of joints with a limit."""
    log = flight.log
    largest = np.zeros(len(log.joint_names))
    for start, stop in flight.blocks():
        np.maximum(largest, np.abs(log.applied_torque[start:stop, 3:]).max(axis=0), out=largest)
    efforts = [limits.effort for limits in flight.robot.limits[: len(largest)]]
    return {
        f"{name}.effort_used": float(most / effort)
        for name, most, effort in zip(log.joint_names, largest, efforts, strict=True)
        if 0.0 < effort < np.inf
    }


@metrics(
    "latency",
    {
        f"latency.{name}_{unit}": Definition(unit, "from a state's sending to its command's")
        for unit in ("ms", "ticks")
        for name in PERCENTILES
    }
    | {"latency.answers": Definition("", "commands whose wall-clock time is known")},
)
def latency(flight: AnalysedLog) -> dict[str, float]:
    """Compute percentiles of the wall-clock time from sending a state to sending its command."""
    times = flight.log.latency_s
    known = np.empty(0) if times is None else times[np.isfinite(times)]
    if not len(known):
        raise InputError("no wall-clock times of states and commands: not flown as a graph")
    numbers = {"latency.answers": float(len(known))}
    for name, percent in PERCENTILES.items():
        value = float(np.percentile(known, percent))
        numbers[f"latency.{name}_ms"] = 1e3 * value
        numbers[f"latency.{name}_ticks"] = value / flight.log.timebase.period
    return numbers


@metrics(
    "commands",
    {
        "commands.unanswered": Definition("ticks", "ticks that no command was ever recorded for"),
        "commands.compared": Definition("ticks", "ticks with a command and the torque applied"),
        "commands.differing": Definition(
            "ticks", "of these, ticks with another torque than commanded, as the command was late"
        ),
    },
)
def commands(flight: AnalysedLog) -> dict[str, float]:
    """Count the ticks without their own command, or with a late one.

    The torque applied over the interval that begins at tick k is reported with the state of tick
    k+1; commanded for it was the answer to tick ``k - latency_ticks``, clipped to the limits. In
    lockstep they are the same to the last bit. By the wall clock the plant holds the command
    before where an answer is late. Drives give another torque than commanded, an echo tells another
    one, and in time: what counts is that neither is as commanded.

    Hardware on the base gives what it can of a torque, and a free base has none: the joints
    alone then tell whether a command was in time, for it is applied as a whole.
    """
    log = flight.log
    if log.commanded_torque is None or not np.isfinite(log.commanded_torque[:, 0]).any():
        raise InputError("the commands were not recorded")
    try:
        limits = flight.torque_limits
    except InputError:
        limits = NO_LIMITS
    axes = slice(3 if log.flight.get("base_actuators") else 0, None)
    delay = int(log.flight.get("command_latency_ticks", 0)) + 1
    limit, reported, answers = limits.each_axis(log.axes), log.as_measured(), log.commanded_torque

    def count(start: int, stop: int) -> NDArray[np.intp]:
        first = min(max(start, delay), stop)
        commanded = np.clip(answers[max(first - delay, 0) : max(stop - delay, 0)], -limit, limit)
        known = np.isfinite(commanded).all(axis=1) & measured_rows(reported, first, stop)
        differ = known.copy()
        for each in (reported, log):
            differ &= np.any(each.applied_torque[first:stop, axes] != commanded[:, axes], axis=1)
        return np.array([np.count_nonzero(differ), np.count_nonzero(known)])

    differing, compared = flight.sum_up(count)
    return {
        "commands.unanswered": float(log.unanswered),
        "commands.compared": float(compared),
        "commands.differing": float(differing),
    }


@series(
    "deflection",
    {"deflection_*": Definition("rad or m", "motor angle less link angle of a joint with a gear")},
)
def deflections(flight: AnalysedLog) -> TimeSeries | None:
    """Return the deflection of each joint with a gear."""
    log = flight.log
    if not log.geared_names:
        return None
    axes = {f"deflection_{name}": [k] for k, name in enumerate(log.geared_names)}
    return TimeSeries(axes, lambda start, stop: deflection(log.rows(start, stop)))


def deflection(log: FlightLog) -> Array:
    """Return ``theta_m - theta`` (N, G) of the joints with gears, rad or m."""
    joints = [log.joint_names.index(name) for name in log.geared_names]
    difference: Array = log.motor_positions - log.joint_positions[:, joints]
    return difference
