"""Plant and controller nodes with a stopwatch, as they are or empty.

    python -m benchmarks.nodes plant|controller full|empty FILE --ros-args ...

The empty ones send and take every message and compute nothing: what the middleware and rclpy
cost. The times are written to FILE (.npz) when the node ends.
"""

from __future__ import annotations

import sys
import time
from array import array
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.loop import ControllerLoop
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.controller.signal_kernels import USABLE
from space_robot_control.controller.supervision import conclude
from space_robot_control.controller.supervisor import Supervisor
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.node_host import NodeKind, run_nodes
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.plant.loop import PlantLoop
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

Array = NDArray[np.float64]


class Stopwatch:
    """Durations of calls by name, ns."""

    def __init__(self) -> None:
        self.durations: dict[str, array[int]] = {}
        self.starts: dict[str, array[int]] = {}

    def attach(self, owner: Any, method: str, name: str) -> None:
        """Time every call of ``owner.method``."""
        setattr(owner, method, self._timed(getattr(owner, method), name))

    def _timed(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        durations = self.durations.setdefault(name, array("q"))
        starts = self.starts.setdefault(name, array("q"))
        is_take = name.startswith("take")
        clock = time.perf_counter_ns

        def timed(*arguments: Any) -> Any:
            begin = clock()
            result = function(*arguments)
            end = clock()
            if not is_take or result is not None:  # a look in vain is waiting
                durations.append(end - begin)
                starts.append(begin)
            return result

        return timed

    def save(self, file: str, **further: Any) -> None:
        """Write ``<name>`` and ``<name> start`` arrays, and further ones."""
        arrays: dict[str, Any] = {name: np.array(values) for name, values in self.durations.items()}
        arrays |= {f"{name} start": np.array(values) for name, values in self.starts.items()}
        np.savez(file, **arrays, **further)


def empty_plant(plant: Plant) -> None:
    """Let ``plant`` count ticks and compute nothing."""

    def step(command: Command) -> None:
        plant.state.tick += 1

    plant.step = step  # type: ignore[method-assign]


def empty_controller(supervisor: Supervisor) -> None:
    """Let ``supervisor`` answer with no torque always."""
    command = Command(0, np.zeros_like(supervisor.controller.signals.error))

    def answer(state: RobotState, reference: Block) -> Command:
        conclude(supervisor.block, state.tick, USABLE)
        command.tick = state.tick
        return command

    supervisor.answer = answer  # type: ignore[method-assign]


class TimedPlantLoop(PlantLoop):
    """The plant node's loop with a stopwatch."""

    file, is_empty = "", False

    def __init__(self, node: ManagedNode[PlantNodeSettings], settings: PlantNodeSettings) -> None:
        """See `PlantLoop`."""
        super().__init__(node, settings)
        self._watch = watch = Stopwatch()
        watch.attach(self._states, "encode", "encode state")
        joints, base = self._state_out
        watch.attach(joints, "publish", "publish joints")
        watch.attach(base, "publish", "publish base")
        watch.attach(self._command_in, "take", "take command")
        self._command_ticks = array("q")
        decode = self._commands.decode

        def noting_tick(data: bytes, command: Command) -> None:
            decode(data, command)
            self._command_ticks.append(command.tick)

        self._commands.decode = noting_tick  # type: ignore[method-assign]
        watch.attach(self._commands, "decode", "decode command")
        if self.is_empty:
            empty_plant(self._plant)
        watch.attach(self._plant, "step", "step plant")

    def close(self) -> None:
        """Write the times down."""
        self._watch.save(
            self.file, command_ticks=self._command_ticks, missed_deadlines=self.missed_deadlines
        )


class TimedControllerLoop(ControllerLoop):
    """The controller node's loop with a stopwatch."""

    file, is_empty = "", False

    def __init__(
        self, node: ManagedNode[ControllerNodeSettings], settings: ControllerNodeSettings
    ) -> None:
        """See `ControllerLoop`."""
        super().__init__(node, settings)
        self._watch = watch = Stopwatch()
        for entry, part in zip(self._states.inputs, ("joints", "base"), strict=True):
            watch.attach(entry, "take", f"take {part}")
            watch.attach(self._states.codec.parts[entry.topic], "decode", f"decode {part}")
        if self.is_empty:
            empty_controller(self._answering.supervisor)
        watch.attach(self._answering.supervisor, "answer", "update controller")
        watch.attach(self._answering, "encode", "encode command")
        watch.attach(self._command_out, "publish", "publish command")

    def close(self) -> None:
        """Write the times down."""
        super().close()
        self._watch.save(self.file)


def main() -> NoReturn:
    """See the module."""
    node, work, file, *arguments = sys.argv[1:]
    TimedPlantLoop.file = TimedControllerLoop.file = file
    TimedPlantLoop.is_empty = TimedControllerLoop.is_empty = work == "empty"
    sys.argv[1:] = arguments  # what rclpy reads
    if node == "plant":
        run_nodes(NodeKind(PlantNodeSettings, TimedPlantLoop))
    run_nodes(NodeKind(ControllerNodeSettings, TimedControllerLoop, changeable=("controller",)))


if __name__ == "__main__":
    main()
