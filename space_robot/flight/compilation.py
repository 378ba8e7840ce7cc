"""Compilation of all kernels before a flight, once per installation.

Two processes share the work: the one that is asked, and this module as a program.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import llvmlite.binding
import numba
import numpy as np

from space_robot_control.allocation.allocation import allocate, allocation_code
from space_robot_control.controller.gains import available_laws
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.laws import CompiledLaw, ControlLaw, laws
from space_robot_msgs_py.compiled.cache import cache_directory, count_compiled, index_files
from space_robot_msgs_py.ros.process import hold_to_standard_input, module_command
from space_robot_msgs_py.samples import Command, Reference, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec, read, write

from ..processes.interruption import child_process, not_lost_in_callbacks
from .plan import Flight, Scenario, resolve

_config: Any = numba.config
MARK, ALLOCATION_MARK, LANES_MARK = "complete", "allocation", "lanes"


def mark_file(what: str) -> Path:
    """Return the file whose existence says that kernels are compiled for this kind of processor."""
    processor = _config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    return cache_directory() / f"{what}.{processor}"


def compile_kernels(with_allocation: bool = False) -> None:
    """Compile all kernels of flights that have changed since the last compilation.

    Else the nodes would compile the same functions side by side in their first tick. The allocation
    is for bases whose actuators are hardware.
    """
    if not (mark := mark_file(MARK)).exists():
        _compile_flights()
        mark.touch()
    if with_allocation and not mark_file(ALLOCATION_MARK).exists():
        with compiling("the allocation", allocate):
            _compile_allocation()


def compile_lanes() -> None:
    """Compile the kernels of flights that fly together, once an installation."""
    compile_kernels()
    if not (mark := mark_file(LANES_MARK)).exists():
        _compile_lanes()
        mark.touch()


def compile_all() -> None:
    """Compile all kernels of flights, also those of a base with hardware."""
    compile_lanes()
    compile_kernels(with_allocation=True)


def load_kernels() -> None:
    """Load the kernels used by nodes from the cache, if it exists."""
    if mark_file(MARK).exists():
        flight = Flight(resolve(Scenario()))
        _step_plant(flight)
        _answer_and_exchange(flight)


def load_lanes() -> None:
    """Load the kernels of flights that fly together from the cache, if they are there."""
    if mark_file(LANES_MARK).exists():
        from .batch import FlightBatch

        FlightBatch([Flight(resolve(Scenario(duration=0.002))) for _ in range(2)]).fly()


def laws_with_gains() -> dict[str, type[ControlLaw]]:
    """Return the laws that fly without any option, by name.

    One that has no gains for the default robot yet is compiled in its first flight.
    """
    return {name: laws()[name] for name in available_laws(ControllerNodeSettings.resolve({}))}


def _compiled_laws() -> dict[str, type[CompiledLaw]]:
    return {name: law for name, law in laws_with_gains().items() if issubclass(law, CompiledLaw)}


@contextmanager
def compiling(what: str, *kernels: Any, again: bool = False) -> Iterator[None]:
    """Show the progress; ``again``: the kernels have been compiled for other types before."""
    from ..console.progress import watching_progress  # only once an installation

    click.echo(f"compiling {what} (once an installation, a minute or two) ...", err=True)
    files = index_files(kernels)
    since = time.time_ns() if again else 0
    shown = watching_progress("kernels", len(files), lambda: count_compiled(files, since))
    with shown, not_lost_in_callbacks():
        yield


def _compile_flights() -> None:
    from .simulate import fly_ticks, simulate  # nodes load kernels without it

    own = [law.kernel for law in _compiled_laws().values()]
    with compiling("the dynamics and the laws", fly_ticks, read, write, *own):
        helper_command = module_command(__name__, "answers")
        with child_process(helper_command, stdout=subprocess.DEVNULL) as helper:
            _step_plant(Flight(resolve(Scenario())))
            helper.wait()
        for law in laws_with_gains():
            simulate(Flight(resolve(Scenario(controller=law, duration=0.002))))
        _step_plant(Flight(resolve(Scenario())))
        _answer_under_every_law()


def _compile_allocation() -> None:
    allocation_code(is_used=True)
    mark_file(ALLOCATION_MARK).touch()


def _step_plant(flight: Flight) -> None:
    flight.plant.step(Command(0, np.zeros(len(flight.plant.names.commanded))))


def _answer_and_exchange(flight: Flight) -> None:
    states = StateCodec(flight.plant.names, flight.timebase)
    commands = CommandCodec(flight.plant.names.commanded, flight.timebase)
    state = RobotState.allocate(flight.robot.n)
    for topic, data in zip(states.topics, states.encode(state), strict=True):
        states.decode(topic, data, state)
    reference = Reference.at_rest(flight.robot.n)
    flight.controller.update(state, reference)
    supervisor = Supervisor(flight.controller, hold_ticks=0)
    supervisor.judge_stamp(0)
    command = supervisor.answer(state, reference)
    commands.decode(commands.encode(command), command)


def _answer_under_every_law() -> None:
    for law in laws_with_gains():
        _answer_and_exchange(Flight(resolve(Scenario(controller=law, navigation="filtered"))))


def _compile_lanes() -> None:
    from .batch import FlightBatch
    from .benches import Benches
    from .lane_loop import fly_benches, fly_lanes, measure_lanes

    own = [law.kernel for law in _compiled_laws().values()]
    kernels = (fly_lanes, measure_lanes, fly_benches, *own)
    with compiling("flights that fly together", *kernels, again=True):
        with child_process(module_command(__name__, "plants")) as helper:
            _compile_controllers_in_lanes()
            helper.wait()
        for name in _compiled_laws():
            scenario = Scenario(controller=name, duration=0.002)
            FlightBatch([Flight(resolve(scenario)) for _ in range(2)]).fly()
        benches = Benches([Flight(resolve(Scenario(duration=0.002)))])
        benches.step(np.zeros((1, len(benches.names.commanded))))


def _compile_plants_in_lanes() -> None:
    from numba import types

    from space_robot_msgs_py.compiled.lane_type import MASK, array_of_lanes
    from space_robot_msgs_py.compiled.lanes import WIDTH
    from space_robot_msgs_py.compiled.record_type import block_type, record_type
    from space_robot_sim.plant.lanes import advance_lanes
    from space_robot_sim.plant.tick import PlantMemory

    from .lane_loop import measure_lanes

    advance: Any = advance_lanes
    measure: Any = measure_lanes
    layout, numbers = PlantMemory.layout(), (types.intp, types.float64)
    records = record_type(layout, WIDTH), block_type(layout, 1)
    advance.compile((*records, array_of_lanes(2), array_of_lanes(1), *numbers, MASK))
    measure.compile((block_type(layout, WIDTH), *numbers))
    _compile_allocation()  # else the other process would be the last to end


def _compile_controllers_in_lanes() -> None:
    from numba import types

    from space_robot_control.controller.signals import ControllerMemory, compute_signals
    from space_robot_control.controller.tick import apply_transfer
    from space_robot_msgs_py.compiled.lane_type import array_of_lanes
    from space_robot_msgs_py.compiled.lanes import WIDTH
    from space_robot_msgs_py.compiled.record_type import block_type
    from space_robot_msgs_py.samples import State

    signals: Any = compute_signals
    transfer: Any = apply_transfer
    controller, row = block_type(ControllerMemory.layout(), WIDTH), array_of_lanes(1)
    state, law = block_type(State.layout(), WIDTH), (row, types.intp, types.boolean)
    signals.compile((controller, types.intp, state, *law, types.float64))
    transfer.compile((controller, types.intp, row, row))


if __name__ == "__main__":
    hold_to_standard_input()
    {"answers": _answer_under_every_law, "plants": _compile_plants_in_lanes}[sys.argv[1]]()
