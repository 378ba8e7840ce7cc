"""Tasks for learning: environments of Gymnasium, one at a time and many in lanes.

env = space_robot.make("reach")
envs = space_robot.make_vec("reach", num_envs=64, threads=2)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.config.validation import one_of

from ..gpu.fly import device_named

if TYPE_CHECKING:
    from .reach_device_env import ReachDeviceEnv
    from .reach_env import ReachEnv, ReachVectorEnv


def make(task: str, **settings: Any) -> ReachEnv:
    """Return an environment of Gymnasium for a task, see `reach_env.ReachEnv`.

    Args:
        task: "reach": the arm moves and the base keeps its attitude; or "point": it keeps the
            direction of its z axis.
        settings: of the task, see `reach_env.ReachTask`.

    Raises:
        InputError: there is no such task, or a setting is out of its range.
        ImportError: Gymnasium is not installed.
    """
    from .reach_env import TASKS, ReachEnv  # Gymnasium is an extra

    return ReachEnv(**{**TASKS[one_of(task, TASKS, "task")], **settings})


def make_vec(
    task: str, num_envs: int = 8, threads: int = 1, device: str = "cpu", **settings: Any
) -> ReachVectorEnv | ReachDeviceEnv:
    """Return a vector environment of Gymnasium: many at once, each with the bits of `make`'s.

    Args:
        task: see `make`.
        num_envs: number of environments; a multiple of 8 fills all lanes.
        threads: among which they are divided.
        device: ``gpu``: on an NVIDIA device, where all arrays stay, see `ReachDeviceEnv`.
        settings: see `make`.
    """
    from .reach_env import TASKS, ReachVectorEnv  # Gymnasium is an extra

    settings = {**TASKS[one_of(task, TASKS, "task")], **settings}
    if place := device_named(device):
        from .reach_device_env import ReachDeviceEnv

        return ReachDeviceEnv(num_envs, place, **settings)
    return ReachVectorEnv(num_envs, threads, **settings)
