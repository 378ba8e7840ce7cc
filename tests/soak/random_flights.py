"""Random flights from a seed, with faults that a flight can survive."""

from __future__ import annotations

import random
import shlex
from collections.abc import Mapping

from space_robot.flight.plan import FlightPlan
from space_robot.scenario.faults import KINDS, NODE_OF
from space_robot_control.laws import laws
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.faults.axes import About
from space_robot_sim.faults.grammar import Argument, Kind, parse_faults

CASES = ("1", "2", "3", "4-1", "4-2")
JOINTS = 6
"""Joints of the paper's robot."""
Counts = Mapping[About, int]
"""How many of each there are, counted from 1."""
ACTUATORS: dict[str, Counts] = {
    "ideal": {},
    "wheels": {About.WHEEL: 4},
    "wheels_and_thrusters": {About.WHEEL: 4, About.THRUSTER: 12},
}
"""Actuators that can fly a case, with how many wheels and thrusters they have."""
MOST_FAULTS, MOST_SWAPS = 4, 2
SHORTEST_S = 0.5
"""A flight is at least that long."""
LIMITS = {
    "P": (1e-3, 0.1),
    "TICKS": (1.0, 3.0),
    "SECONDS": (0.5, 3.0),
    "SIGMA": (1e-8, 1e-6),
    "STEP": (1e-8, 1e-6),
    "TORQUE": (0.01, 1.0),
    "RATE": (1e-8, 1e-6),
    "FACTOR": (0.995, 1.005),
    "noise_joint_velocity": (1e-7, 1e-5),
    "stuck_joint": (5.0, 20.0),
    "torque_bias": (1e-5, 1e-3),
    "drive_bias": (1e-5, 1e-3),
}
"""Least and largest argument by its symbol, or by the kind of the fault."""
LONGEST_S = {
    "saturate_base": 0.2,
    "saturate_joints": 0.2,
    "stuck_joint": 1.0,
    "tracker_blind": 0.02,
    "encoder_stuck": 0.02,
}
"""Longest time of a fault that takes too much to be flown with for long."""
SILENCING = ("drop_state", "drop_command")
SILENCE_S = 0.3
SILENCE_SHARE = 0.25
EARLIEST_S = {"kill_recorder": 1.5}
"""Before that the bag may hold nothing yet: its first chunk ends after 0.25 s of the wall clock."""
BREAKING = (
    "kill_controller",
    "stop_controller",
    "kill_mission",
    "stop_mission",
    "saturate_base",
    "saturate_joints",
    "stuck_joint",
    "tracker_blind",
    "encoder_stuck",
    "wheel_fail",
    "thruster_stuck_on",
    "thruster_stuck_off",
)
"""Faults that take torque, reference or a measurement away, or give a torque nobody asked for."""


def sample_flight(seed: int, index: int, duration_s: float = 5.0) -> FlightPlan:
    """Return a random flight: law, case, actuators, swaps, one to four faults.

    The same for the same arguments. Kinds differ within a flight, and recorder and mission fail
    at most once: a process that was killed cannot be stopped.

    Args:
        seed: seed of all flights.
        index: number of the flight among those of the seed.
        duration_s: how long it flies, at least `SHORTEST_S`.
    """
    rng = random.Random(f"{seed}/{index}")
    names, actuators = sorted(laws()), rng.choice(list(ACTUATORS))
    return FlightPlan(
        controller=rng.choice(names),
        case=rng.choice(CASES),
        actuators=actuators,
        duration=duration_s,
        faults=_faults(rng, duration_s, actuators),
        seed=rng.randrange(2**31),
        swaps=[
            f"{ms / 1000}:{rng.choice(names)}"
            for ms in sorted(rng.sample(_within(duration_s), rng.randint(0, MOST_SWAPS)))
        ],
        restart_controller=True,
    )


def breaks_tracking(plan: FlightPlan) -> bool:
    """Return whether a flight's faults take torque or reference away, so that errors must grow."""
    faults = parse_faults(plan.faults, KINDS)
    return any(
        f.kind.name in BREAKING or (f.kind.name in SILENCING and f.value == 1.0) for f in faults
    )


def command_line(plan: FlightPlan) -> str:
    """Return the command that flies a sampled flight again."""
    words = f"space-robot fly --controller {plan.controller} --case {plan.case}".split()
    words += f"--actuators {plan.actuators} --duration {plan.duration} --seed {plan.seed}".split()
    for option, texts in (("--swap", plan.swaps), ("--fault", plan.faults)):
        for text in texts:
            words += [option, text]
    return shlex.join([*words, "--restart-controller"])


def _within(duration_s: float) -> range:
    """Return the ms at which something may begin: not in a flight's first and last moments."""
    return range(round(100 * duration_s), round(900 * duration_s))


def _faults(rng: random.Random, duration_s: float, actuators: str) -> list[str]:
    latest_s = _within(duration_s)[-1] / 1000
    counts = {About.AXIS: JOINTS, About.JOINT: JOINTS, **ACTUATORS[actuators]}
    kinds = [
        kind
        for kind in KINDS.values()
        if EARLIEST_S.get(kind.name, 0.0) < latest_s
        and _is_there(kind, counts)
        and (actuators == "ideal" or kind.name != "saturate_base")
    ]
    texts, failed = [], set()
    for kind in rng.sample(kinds, rng.randint(1, MOST_FAULTS)):
        node = NODE_OF.get(kind)
        if node and node != "controller":
            if node in failed:
                continue
            failed.add(node)
        texts.append(_fault(rng, kind, duration_s, counts))
    return texts


def _fault(rng: random.Random, kind: Kind, duration_s: float, counts: Counts) -> str:
    may_begin = _within(duration_s)
    start = rng.randrange(
        max(may_begin.start, round(1000 * EARLIEST_S.get(kind.name, 0.0))), may_begin.stop
    )
    is_silence = kind.name in SILENCING and rng.random() < SILENCE_SHARE
    stop = ""
    if kind.lasts:
        longest_s = SILENCE_S if is_silence else LONGEST_S.get(kind.name, duration_s)
        latest = min(round(1000 * duration_s), start + round(1000 * longest_s))
        stop = f"-{rng.randint(start + 1, latest) / 1000}"
    argument = ""
    if kind.argument and not is_silence:
        argument = f":{_argument(rng, kind.name, kind.argument, counts)}"
    return f"{kind.name}@{start / 1000}{stop}{argument}"


def _is_there(kind: Kind, counts: Counts) -> bool:
    about = kind.argument.about if kind.argument else None
    return about in (None, About.BASE_AXIS) or about in counts


def _argument(rng: random.Random, kind: str, argument: Argument, counts: Counts) -> str:
    if not argument.symbol:
        return _axis(rng, argument, counts)
    low, high = LIMITS.get(kind, LIMITS[argument.symbol])
    if argument.whole:
        return str(rng.randint(round(low), round(high)))
    # as often from 1e-8 to 1e-7 as from 1e-7 to 1e-6
    number = f"{low * (high / low) ** rng.random():.4g}"
    return f"{_axis(rng, argument, counts)}={number}" if argument.about else number


def _axis(rng: random.Random, argument: Argument, counts: Counts) -> str:
    if argument.about is None or argument.about is About.BASE_AXIS:
        return rng.choice(BASE_AXES)
    return str(rng.randint(1, counts[argument.about]))
