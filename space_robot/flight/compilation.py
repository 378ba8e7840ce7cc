"""Compilation of all kernels before a flight, once per installation."""

from __future__ import annotations

import subprocess
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

from ..processes.child_process import child_process
from ..processes.interruption import not_lost_in_callbacks
from .closed_loop import fly_ticks
from .plan import Flight, Scenario, resolve

_config: Any = numba.config
MARK, ALLOCATION_MARK = "complete", "allocation"


def mark_file(what: str) -> Path:
    """Return the file whose existence says that kernels are compiled for this kind of processor."""
    processor = _config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    return cache_directory() / f"{what}.{processor}"


def compile_kernels(with_allocation: bool = False) -> None:
    """Compile all kernels of flights that have changed since the last compilation.

    Else the nodes would compile the same functions side by side in their first tick. The allocation
    is for bases whose actuators are hardware.
    """
    _compile_flights()
    mark = mark_file(ALLOCATION_MARK)
    if with_allocation and not mark.exists():
        with compiling("the allocation", allocate):
            allocation_code(is_used=True)
        mark.touch()


def _compile_flights() -> None:
    """Fly a few ticks under every law.

    The controller's kernels are compiled by a second process while this one compiles the plant's.
    """
    mark = mark_file(MARK)
    if mark.exists():
        return
    from .simulate import simulate  # nodes load kernels without it

    own = [law.kernel for law in laws_with_gains().values() if issubclass(law, CompiledLaw)]
    with compiling("the dynamics and the laws", fly_ticks, read, write, *own):
        with child_process(module_command(__name__), stdout=subprocess.DEVNULL) as helper:
            _step_plant(Flight(resolve(Scenario())))
            helper.wait()
        for law in laws_with_gains():
            simulate(Flight(resolve(Scenario(controller=law, duration=0.002))))
        _step_plant(Flight(resolve(Scenario())))
        _answer_under_every_law()
    mark.touch()


def laws_with_gains() -> dict[str, type[ControlLaw]]:
    """Return the laws that fly without any option, by name.

    One that has no gains for the default robot yet is compiled in its first flight.
    """
    return {name: laws()[name] for name in available_laws(ControllerNodeSettings.resolve({}))}


@contextmanager
def compiling(what: str, *kernels: Any, again: bool = False) -> Iterator[None]:
    """Show the progress of compilation, including other processes.

    ``again``: the kernels have been compiled for other types before.
    """
    from ..console.progress import watching_progress  # only once an installation

    click.echo(f"compiling {what} (once an installation, a minute or two) ...", err=True)
    files = index_files(kernels)
    since = time.time_ns() if again else 0
    shown = watching_progress("kernels", len(files), lambda: count_compiled(files, since))
    with shown, not_lost_in_callbacks():
        yield


def load_kernels() -> None:
    """Load the kernels used by nodes from the cache, if it exists."""
    if mark_file(MARK).exists():
        flight = Flight(resolve(Scenario()))
        _step_plant(flight)
        _answer_and_exchange(flight)


def _step_plant(flight: Flight) -> None:
    flight.plant.step(Command(0, np.zeros(len(flight.plant.names.commanded))))


def _answer_and_exchange(flight: Flight) -> None:
    """Compile the controller's entry point and the messages."""
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


if __name__ == "__main__":
    hold_to_standard_input()
    _answer_under_every_law()
