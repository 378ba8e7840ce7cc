"""Compilation of the kernels of batches, in two processes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from space_robot_control.controller.signals import ControllerMemory, compute_signals
from space_robot_control.controller.tick import apply_transfer
from space_robot_control.laws import CompiledLaw
from space_robot_msgs_py.compiled.lane_type import MASK, array_of_lanes
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.record_type import block_type, record_type
from space_robot_msgs_py.ros.process import hold_to_standard_input, module_command
from space_robot_msgs_py.samples import State
from space_robot_sim.plant.lanes import advance_lanes
from space_robot_sim.plant.tick import PlantMemory

from ...processes.child_process import child_process
from ..compilation import compile_kernels, compiling, laws_with_gains, mark_file
from ..plan import Flight, Scenario, resolve
from .batch import FlightBatch
from .bench_loop import fly_benches
from .benches import Benches
from .lane_loop import fly_lanes, measure_lanes

MARK = "lanes"


def compile_all() -> None:
    """Compile all kernels of flights, also those of a base with hardware."""
    compile_kernels(with_allocation=True)
    compile_lanes()


def compile_lanes() -> None:
    """Compile the kernels of flights that fly together, once an installation."""
    compile_kernels()
    mark = mark_file(MARK)
    if mark.exists():
        return
    own = [law.kernel for law in laws_with_gains().values() if issubclass(law, CompiledLaw)]
    kernels = (fly_lanes, measure_lanes, fly_benches, *own)
    with compiling("flights that fly together", *kernels, again=True):
        with child_process(module_command(__name__)) as helper:
            _compile_controllers()
            helper.wait()
        _fly_all_laws()
    mark.touch()


def load_lanes() -> None:
    """Load the kernels of flights that fly together from the cache, if they are there."""
    if mark_file(MARK).exists():
        FlightBatch([Flight(resolve(Scenario(duration=0.002))) for _ in range(2)]).fly()


def _block(record: Any, width: int = WIDTH) -> Any:
    return block_type(record.layout(), width)


def _compile_plants() -> None:
    """Compile the plant's kernels in lanes."""
    plant, row = record_type(PlantMemory.layout(), WIDTH), array_of_lanes(1)
    alone, numbers = _block(PlantMemory, 1), (types.intp, types.float64)
    advance: Any = advance_lanes
    advance.compile((plant, alone, array_of_lanes(2), row, *numbers, MASK))
    measure: Any = measure_lanes
    measure.compile((_block(PlantMemory), *numbers))


def _compile_controllers() -> None:
    """Compile the controller's kernels in lanes."""
    controller, row = _block(ControllerMemory), array_of_lanes(1)
    signals: Any = compute_signals
    of_law = row, types.intp, types.boolean
    signals.compile((controller, types.intp, _block(State), *of_law, types.float64))
    transfer: Any = apply_transfer
    transfer.compile((controller, types.intp, row, row))


def _fly_all_laws() -> None:
    """Fly a few ticks under every law with a kernel, and one on a bench."""
    for name, law in laws_with_gains().items():
        if issubclass(law, CompiledLaw):
            plan = Scenario(controller=name, duration=0.002)
            for _ in FlightBatch([Flight(resolve(plan)) for _ in range(2)]).fly():
                pass
    benches = Benches([Flight(resolve(Scenario(duration=0.002)))])
    benches.step(np.zeros((1, len(benches.names.commanded))))


if __name__ == "__main__":
    hold_to_standard_input()
    _compile_plants()
