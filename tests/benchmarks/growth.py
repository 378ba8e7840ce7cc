"""How the time grows with the number of joints, for random serial robots."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from checks import HAS_BASILISK, same_motion
from peers import BATCH, FRICTION, MuJoCo, Ours, Peer, Pinocchio, Start
from random_robots import random_robot

from space_robot_control.bench import Options, interleave

JOINTS = (3, 5, 7, 10, 15, 20, 30)
LARGE = 10
"""Joints from which on the growth is stated once more: below, what is constant hides it."""
CHECK_STEPS = 200


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

    def exponent(self, competitor: str, least: int = 0) -> float | None:
        """k of ``time ~ n^k`` by least squares of the logarithms, for n from ``least`` on."""
        points = [
            (np.log(n), np.log(median))
            for n, median in zip(self.joints, self.medians_us(competitor), strict=True)
            if n >= least
        ]
        if len(points) < 2:
            return None
        return float(np.polyfit(*np.transpose(points), 1)[0])

    def record(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {
            "joints": list(self.joints),
            "first_call_s": self.first_call_s,
            "competitors": {
                name: {
                    "median_us": self.medians_us(name),
                    "exponent": self.exponent(name),
                    f"exponent_from_{LARGE}_joints": self.exponent(name, LARGE),
                    "samples_us": samples,
                }
                for name, samples in self.samples_us.items()
            },
            "checks": self.checks,
        }


def growth(options: Options, joints: Sequence[int] = JOINTS) -> Growth:
    """Forward dynamics beside Pinocchio's, steps beside MuJoCo's and Basilisk's."""
    found = Growth(tuple(joints))
    for n in joints:
        options.progress(f"{n} joints")
        robot = random_robot(np.random.default_rng(n), n)
        start = Start.moving(robot, rate=0.5, torque=1.0)
        peers: list[Peer] = [MuJoCo(start)]
        if HAS_BASILISK:
            from basilisk import Basilisk

            peers.append(Basilisk(start))
        ours, pinocchio = Ours(start, with_environment=True), Pinocchio(start)
        found.first_call_s.append(
            {"step": _timed(ours.step), "forward dynamics": _timed(ours.forward_dynamics)}
        )
        found.checks += same_motion(start, [*peers, Pinocchio(start)], CHECK_STEPS)
        start = Start.moving(robot)
        competitors: dict[str, Callable[[int], None]] = {
            "space_robot, step": Ours(start, with_environment=True).step,
            "mujoco, step": MuJoCo(start, FRICTION.viscous).step,
            "space_robot, forward dynamics": Ours(start, True).forward_dynamics,
            "pinocchio, aba in C++": pinocchio.batches_in_cpp,
            "pinocchio, aba from Python": pinocchio.calls,
        }
        if HAS_BASILISK:
            competitors["basilisk, step"] = Basilisk(start, FRICTION.viscous).step
        seconds = interleave(
            competitors, options.batches(usual=9), batch_s=min(options.batch_s, 0.02)
        )
        for name, times in seconds.items():
            calls = BATCH if name == "pinocchio, aba in C++" else 1
            found.samples_us.setdefault(name, []).append([1e6 * t / calls for t in times])
    return found


def _timed(call: Callable[[int], None]) -> float:
    begin = time.perf_counter()
    call(1)
    return time.perf_counter() - begin
