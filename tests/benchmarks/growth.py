"""How the time grows with the number of joints, for random serial robots."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from checks import HAS_BASILISK, all_peers, same_motion
from peers import BATCH, FRICTION, MuJoCo, Ours, Pinocchio, Start
from random_robots import random_robot

from space_robot_control.bench import Options, interleave
from space_robot_control.bench.measure import Competitor

JOINTS = (3, 5, 7, 10, 15, 20, 30)
SHORT_JOINTS = (6, 7)
LARGE = 10
"""Joints from which on the growth is stated once more: below, what is constant hides it."""
CHECK_STEPS = 200
IN_CPP = "pinocchio, aba in C++"


@dataclass
class Growth:
    """Times by competitor and number of joints."""

    joints: tuple[int, ...]
    samples_us: dict[str, list[list[float]]] = field(default_factory=dict)
    """By competitor; a list of samples for each number of joints."""
    first_call_s: list[dict[str, float]] = field(default_factory=list)
    """Of our kernels, for each number of joints; they are compiled for each."""
    checks: list[dict[str, Any]] = field(default_factory=list)

    def medians_us(self, competitor: str) -> list[float]:
        """One for each number of joints."""
        return [float(np.median(samples)) for samples in self.samples_us[competitor]]

    def exponents(self, competitor: str, least: int = 0) -> list[float]:
        """k of ``time ~ n^k`` by least squares of the logarithms, for n from ``least`` on.

        One for each repetition: the sizes are measured in turn, so a machine that is slow for a
        while is so for all of them. Empty if there are fewer than two sizes.
        """
        large = [n >= least for n in self.joints]
        if sum(large) < 2:
            return []
        logarithms = np.log(self.samples_us[competitor])[large]
        sizes = np.log(np.array(self.joints)[large])
        return [float(np.polyfit(sizes, times, 1)[0]) for times in logarithms.T]

    def exponent(self, competitor: str, least: int = 0) -> float | None:
        """Median of `exponents`."""
        found = self.exponents(competitor, least)
        return float(np.median(found)) if found else None

    def record(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {
            "joints": list(self.joints),
            "first_call_s": self.first_call_s,
            "competitors": {
                name: {
                    "median_us": self.medians_us(name),
                    "exponent": self.exponent(name),
                    "exponents": self.exponents(name),
                    f"exponent_from_{LARGE}_joints": self.exponent(name, LARGE),
                    f"exponents_from_{LARGE}_joints": self.exponents(name, LARGE),
                    "samples_us": samples,
                }
                for name, samples in self.samples_us.items()
            },
            "checks": self.checks,
        }


def growth(options: Options, joints: Sequence[int] = JOINTS) -> Growth:
    """Forward dynamics beside Pinocchio's, steps beside MuJoCo's and Basilisk's."""
    found = Growth(tuple(joints))
    sizes: dict[str, list[Competitor]] = {}
    for n in joints:
        options.progress(f"the first call and the motion of {n} joints")
        robot = random_robot(np.random.default_rng(n), n)
        pushed, start = Start.moving(robot, rate=0.5, torque=1.0), Start.moving(robot)
        ours = Ours(pushed, with_environment=True)
        found.first_call_s.append(
            {"step": _timed(ours.step), "forward dynamics": _timed(ours.forward_dynamics)}
        )
        found.checks += same_motion(pushed, all_peers(pushed), CHECK_STEPS)
        for name, run in _competitors(start).items():
            sizes.setdefault(name, []).append(run)
    options.progress("all of them in turn")
    flat = {f"{name} {i}": run for name, runs in sizes.items() for i, run in enumerate(runs)}
    seconds = interleave(flat, options.batches(), batch_s=min(options.batch_s, 0.02))
    for name, runs in sizes.items():
        scale = 1e6 / (BATCH if name == IN_CPP else 1)
        found.samples_us[name] = [
            [scale * t for t in seconds[f"{name} {i}"]] for i in range(len(runs))
        ]
    return found


def _competitors(start: Start) -> dict[str, Competitor]:
    ours, pinocchio = Ours(start, with_environment=True), Pinocchio(start)
    competitors: dict[str, Competitor] = {
        "space_robot, step": ours.step,
        "mujoco, step": MuJoCo(start, FRICTION.viscous).step,
        "space_robot, forward dynamics": Ours(start, with_environment=True).forward_dynamics,
        IN_CPP: pinocchio.batches_in_cpp,
        "pinocchio, aba from Python": pinocchio.calls,
    }
    if HAS_BASILISK:
        from basilisk import Basilisk

        competitors["basilisk, step"] = Basilisk(start, FRICTION.viscous).step
    return competitors


def _timed(call: Callable[[int], None]) -> float:
    begin = time.perf_counter()
    call(1)
    return time.perf_counter() - begin
