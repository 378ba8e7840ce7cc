"""How the time grows with the number of joints, for random serial robots."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from strategies import random_robot

from ..measure import Competitor, Options, interleave
from ..peers import is_installed
from ..peers.checks import all_peers, same_motion
from ..peers.simulators import BATCH, FRICTION, MuJoCo, Ours, Pinocchio, Start
from ..result import Result

JOINTS = (3, 5, 7, 10, 15, 20, 30)
SHORT_JOINTS = (6, 7)
LARGE = 10
"""Joints from which on the growth is stated once more: below, what is constant hides it."""
CHECK_STEPS = 200
STEP, DYNAMICS = "space_robot, step", "space_robot, forward dynamics"
IN_CPP = "pinocchio, aba in C++"
BESIDE = {
    "mujoco, step": STEP,
    "basilisk, step": STEP,
    IN_CPP: DYNAMICS,
    "pinocchio, aba from Python": DYNAMICS,
}
"""What of ours stands beside a peer's."""


@dataclass
class Growth:
    """Times by competitor and number of joints."""

    joints: tuple[int, ...]
    samples_us: dict[str, list[list[float]]] = field(default_factory=dict)
    """By competitor; a list of samples for each number of joints."""

    def exponents(self, competitor: str, least: int = 0) -> tuple[float, ...]:
        """k of ``time ~ n^k`` by least squares of the logarithms, for n from ``least`` on.

        One for each repetition: the sizes are measured in turn, so a machine that is slow for a
        while is so for all of them. Empty if there are fewer than two sizes.
        """
        large = [n >= least for n in self.joints]
        if sum(large) < 2:
            return ()
        logarithms = np.log(self.samples_us[competitor])[large]
        sizes = np.log(np.array(self.joints)[large])
        return tuple(float(np.polyfit(sizes, times, 1)[0]) for times in logarithms.T)

    def results(self) -> list[Result]:
        """Times by number of joints, then exponents."""
        rows = []
        for peer, ours in BESIDE.items():
            if peer in self.samples_us:
                rows += [
                    Result.timed(
                        f"{ours}, {n} joints",
                        "us",
                        [1e-6 * t for t in self.samples_us[ours][i]],
                        (peer, [1e-6 * t for t in self.samples_us[peer][i]]),
                    )
                    for i, n in enumerate(self.joints)
                ]
        for least, where in ((0, "all sizes"), (LARGE, f"from {LARGE} joints on")):
            for name in self.samples_us:
                if found := self.exponents(name, least):
                    rows.append(Result(f"exponent, {where}: {name}", "", found))
        return rows


def growth(options: Options) -> list[Result]:
    """Forward dynamics beside Pinocchio's, steps beside MuJoCo's and Basilisk's."""
    joints = SHORT_JOINTS if options.short else JOINTS
    found = Growth(joints)
    sizes: dict[str, list[Competitor]] = {}
    first_calls, checks = [], []
    for n in joints:
        options.progress(f"the first call and the motion of {n} joints")
        robot = random_robot(np.random.default_rng(n), n)
        pushed, start = Start.moving(robot, rate=0.5, torque=1.0), Start.moving(robot)
        ours = Ours(pushed, with_environment=True)
        for name, call in (("step", ours.step), ("forward dynamics", ours.forward_dynamics)):
            first_calls.append(
                Result(f"first {name} of a process, {n} joints", "s", (_seconds(call),))
            )
        checks += same_motion(pushed, all_peers(pushed), CHECK_STEPS)
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
    if options.plot:
        from ..growth_plot import draw_growth

        draw_growth(found, options.plot)
    return [*found.results(), *first_calls, *checks]


def _competitors(start: Start) -> dict[str, Competitor]:
    ours, pinocchio = Ours(start, with_environment=True), Pinocchio(start)
    competitors: dict[str, Competitor] = {
        STEP: ours.step,
        "mujoco, step": MuJoCo(start, FRICTION.viscous).step,
        DYNAMICS: Ours(start, with_environment=True).forward_dynamics,
        IN_CPP: pinocchio.batches_in_cpp,
        "pinocchio, aba from Python": pinocchio.calls,
    }
    if is_installed("Basilisk"):
        from ..peers.basilisk import Basilisk

        competitors["basilisk, step"] = Basilisk(start, FRICTION.viscous).step
    return competitors


def _seconds(call: Callable[[int], None]) -> float:
    begin = time.perf_counter()
    call(1)
    return time.perf_counter() - begin
