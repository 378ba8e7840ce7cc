"""One step of the paper's robot with its payload, friction and disturbances, beside the peers."""

from __future__ import annotations

from ..measure import Options, interleave
from ..peers import is_installed
from ..peers.checks import all_peers, same_motion
from ..peers.simulators import BATCH, FRICTION, MuJoCo, Ours, Pinocchio, Start
from ..result import Result, Target
from .plant import moving_plant

CHECK_STEPS = 400


def peers(options: Options) -> list[Result]:
    """Rows beside each peer, and the checks that it is the same robot.

    The peers have viscous friction only, which costs them least; MuJoCo with Coulomb friction, a
    constraint there, has a row of its own. Our step has both frictions and the disturbances.
    """
    robot = moving_plant().robot
    pushed, start = Start.moving(robot, rate=0.3, torque=2.0), Start.moving(robot)
    checks = same_motion(pushed, all_peers(pushed), CHECK_STEPS)
    ours, pinocchio = Ours(start, with_environment=True), Pinocchio(start)
    pinocchio.assert_batches_are_calls()
    competitors = {
        "ours": ours.step,
        "mujoco": MuJoCo(start, FRICTION.viscous).step,
        "mujoco, friction loss": MuJoCo(start, FRICTION.viscous, FRICTION.coulomb).step,
        "aba": pinocchio.calls,
        "aba in C++": pinocchio.batches_in_cpp,
    }
    if is_installed("Basilisk"):
        from ..peers.basilisk import Basilisk

        competitors["basilisk"] = Basilisk(start, FRICTION.viscous).step
    options.progress("one plant step beside its peers")
    seconds = interleave(competitors, options.batches(), batch_s=options.batch_s)

    def row(peer: str, label: str, target: Target | None = None, factor: float = 1.0) -> Result:
        times = [factor * value for value in seconds[peer]]
        return Result.timed("plant step", "us", seconds["ours"], (label, times), target)

    results = [
        row("mujoco", "mujoco", Target(1.0, 1.5, "ratio")),
        row("mujoco, friction loss", "mujoco, friction loss", Target(1.0, 1.5, "ratio")),
        row("aba", "pinocchio, 4 aba from Python", factor=4.0),
        row("aba in C++", "pinocchio, 4 aba in C++", factor=4.0 / BATCH),
    ]
    if is_installed("Basilisk"):
        results.insert(2, row("basilisk", "basilisk", Target(5.0, 8.0, "ratio")))
    return results + checks
