"""The task "reach" on a device: environments whose arrays stay there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.flight_code.c99 import language as lang
from space_robot_control.flight_code.software import argument
from space_robot_model.elementary.normal import pcg64
from space_robot_msgs_py.config.arguments import as_whole_number
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.tick import PlantMemory

from ..gpu.device import Device, Memory
from ..gpu.structs import argument_struct, packed
from ..gpu.translation import Call, Translation, sizes_of
from .reach import Reach, begin_episode, draw_episode, step_alone
from .reach_env import Info, ReachEnvs

MOST_ENVS = 1 << 24
LAST_SEED = (1 << 32) - 1
GENERATOR = lang.TupleOf((lang.UINT,) * 4)
"""State of a generator of random numbers."""


class ReachDeviceEnv(ReachEnvs):
    """Many `ReachEnv` on a device, one a thread; each has the bits of its own.

    Observations, rewards and flags are arrays on the device, which the next step overwrites;
    ``torch.from_dlpack(envs.observations)`` and the like have them without a copy. Random numbers
    are drawn there. Episodes that are over begin anew as in `ReachVectorEnv`.
    """

    def __init__(self, num_envs: int, device: Device, **settings: Any) -> None:
        """Create the environments.

        Args:
            num_envs: their number.
            device: where they are.
            settings: of `ReachTask`.
        """
        super().__init__(num_envs, MOST_ENVS, settings)
        task = self.task
        self._device, count, axes = device, self.num_envs, task.n + 3
        reach = Reach.block(task.n)
        task.describe(reach)
        translation = _translated(task.flight, task.begin.block)
        files, store = translation.files, device.store
        self._arrays = {
            "begin": store(packed(task.begin.block, files.dtype(PlantMemory))),
            "first": store(packed(reach, files.dtype(Reach))),
            "states": store(np.zeros((task.state_size, count))),
            "reaches": store(np.zeros(count, files.dtype(Reach))),
            "generators": store(np.zeros((count, 4), np.uint64)),
            "over": store(np.ones(count, np.uint8)),
            "actions": store(np.zeros((count, axes))),
            "observations": store(np.zeros((count, 2 * axes))),
            "rewards": store(np.zeros(count)),
            "failed": store(np.zeros(count, np.bool_)),
            "truncated": store(np.zeros(count, np.bool_)),
        }
        self.observations = self._arrays["observations"]
        """(num_envs, 2 m) of the last step."""
        self._program = device.compile(_text(translation, task.state_size, axes))
        self._seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Memory, Info]:
        """Start an episode of each environment; ``options`` is not used.

        ``seed``: of the first; the next ones have the numbers after it, to 4294967295.
        """
        if seed is not None or not self._seeded:
            last = LAST_SEED + 1 - self.num_envs
            if seed is None:
                seed = int(np.random.default_rng().integers(last + 1))
            self._run("seed", as_whole_number(seed, "seed", 0, last))
            self._seeded = True
        self._arrays["over"].write(np.ones(self.num_envs, np.uint8))
        self._run("step")
        return self.observations, {}

    def step(self, actions: Any) -> tuple[Memory, Memory, Memory, Memory, Info]:
        """Apply an action of each environment.

        Args:
            actions: (num_envs, m) float64 in C order: an array on the device, as of PyTorch, CuPy
                or JAX; or one of NumPy, which is copied there.
        """
        if not self._seeded:
            raise InputError("reset the environments before the first step")
        own = self._arrays["actions"]
        there = getattr(actions, "__cuda_array_interface__", None)
        shape, kind = (there["shape"], there["typestr"]) if there else _described(actions)
        if tuple(shape) != own.shape or kind != "<f8" or (there and there.get("strides")):
            raise InputError(
                f"actions: an array {own.shape} of float64 in C order was expected, got one "
                f"{tuple(shape)} of {kind}"
            )
        if there:
            self._run("step", actions=there["data"][0])
        else:
            own.write(np.asarray(actions))
            self._run("step")
        arrays = self._arrays
        return self.observations, arrays["rewards"], arrays["failed"], arrays["truncated"], {}

    def _run(self, function: str, seed: int = 0, actions: int | None = None) -> None:
        task = self.task
        numbers = {
            "count": self.num_envs,
            "ticks": task.ticks_per_step,
            "seed": seed,
            "period": task.period,
            "spread": task.start_spread,
            "distance": task.reach,
        }
        pointers = {name: array.pointer for name, array in self._arrays.items()}
        pointers["actions"] = actions or pointers["actions"]
        argument = self._device.store(argument_struct(numbers, pointers))
        self._program.run(function, self.num_envs, argument)


def _described(actions: Any) -> tuple[tuple[int, ...], str]:
    array: NDArray[Any] = np.asarray(actions)
    return array.shape, array.dtype.str


def _translated(flight: Any, plant: NDArray[Any]) -> Translation:
    plants, reaches = argument(lang.BlockOf(PlantMemory)), argument(lang.BlockOf(Reach))
    whole, number = argument(lang.INT), argument(lang.FLOAT)
    buffer = argument(lang.ArrayOf((0, flight.robot.n + 3)))
    calls: dict[str, Call] = {
        "seed": (pcg64, (whole, whole, whole)),
        "draw": (draw_episode, (argument(GENERATOR), plants, reaches, number, number)),
        "begin_episode": (begin_episode, (plants, reaches, number)),
        "step": (step_alone, (plants, buffer, reaches, whole, number)),
    }
    parts, records = [(PlantMemory, plant)], (PlantMemory, Reach)
    return Translation(calls, parts, records, sizes_of(flight), flight.robot.n)


def _text(translation: Translation, numbers: int, axes: int) -> str:
    texts = {"plant": "&plant", "reach": "&reach", "period": "period"}
    step = {**texts, "command_delay_buffer": "buffer", "ticks": "all->ticks"}
    draw = {**texts, "random": "random", "spread": "all->spread", "distance": "all->distance"}
    return translation.render(
        "reach.cu.j2",
        plant=PlantMemory,
        reach=Reach,
        generator=translation.program.tuple_name(GENERATOR),
        numbers=numbers,
        axes=axes,
        seed=translation.call("seed", {"first": "all->seed + place", "second": "0", "third": "0"}),
        draw=translation.call("draw", draw),
        begin_episode=translation.call("begin_episode", texts),
        step=translation.call("step", step),
    )
