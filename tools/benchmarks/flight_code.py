"""The flight code in C beside its kernels: time of a tick, bytes of code, state and stack."""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from kernels import answered_states
from measuring import Competitor, Row, Run, timed
from plant import flight_of

from space_robot.export.software import export
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.flight_code.c99.program import CALL, Function
from space_robot_control.flight_code.folder import FLAGS, Exported
from space_robot_control.flight_code.instances import build_library, fill_measurement, write_sources
from space_robot_control.laws import CompiledLaw, laws
from space_robot_msgs_py.samples import Reference

SETTINGS: tuple[dict[str, Any], ...] = (
    {},
    {"navigation": "filtered", "sensors": "fine", "actuators": "wheels"},
)
"""Of the flights: ideal, and all that the flight software has."""
TICKS = 400
LOOP = """
#include "space_robot_flight.h"

void answered_states(space_robot_state *state, const space_robot_measurement *measurements,
    const space_robot_reference *references, int64_t count)
{
    space_robot_command command;
    for (int64_t k = 0; k < count; ++k) {
        (void)space_robot_step(state, &measurements[k], &references[k], &command);
    }
}
"""


def flight_code(run: Run) -> Iterator[Row]:
    """Time every law, ideal and with navigation and wheels."""
    for settings in SETTINGS[:1] if run.short else SETTINGS:
        about = " with navigation and wheels" if settings else ""
        for law in sorted(laws())[:2] if run.short else sorted(laws()):
            run.progress(f"{law}{about}")
            plan = {"controller": law, "duration": TICKS * 5e-4, **settings}
            exported = export(flight_of(**plan))
            flown = _fly(plan, exported)
            competitors = {"C": _in_c(exported, flown), "Numba": _numba(plan, flown)}
            seconds = run.interleave(competitors)
            own, other = ([s / TICKS for s in seconds[name]] for name in competitors)
            yield timed(f"{law}{about}, cc -O2", "ns", own, ("Numba", other), _sizes(exported))


def _fly(plan: dict[str, Any], exported: Exported) -> tuple[Any, ...]:
    """Return states and references of a flight, as kernels and then as C take them."""
    flight = flight_of(**plan)
    references = flight.mission.chunk(0, TICKS).references()
    states = np.zeros(TICKS, flight.plant.state.block.dtype)
    measurements = np.zeros(TICKS, exported.measurement_type)
    wanted = np.zeros(TICKS, np.dtype(exported.translated.dtype(Reference)))
    for name in wanted.dtype.names or ():
        wanted[name] = references[name]
    for k in range(TICKS):
        state = flight.plant.state
        states[k] = state.block[0]
        fill_measurement(measurements[k : k + 1], state)
        flight.plant.step(flight.controller.update(state, references[k : k + 1]))
    return states, references, measurements, wanted


def _numba(plan: dict[str, Any], flown: tuple[Any, ...]) -> Competitor:
    controller = flight_of(**plan).controller
    law = controller.law
    assert isinstance(law, CompiledLaw)
    blocks = Supervisor(controller, hold_ticks=200).block, controller.block, law.memory_block
    start = [block.copy() for block in blocks]
    code, rows = (law.code, controller.allocate), flown[:2]
    arguments: list[Any] = [*blocks[:2], *code, *rows, controller.period]

    def run(loops: int) -> None:
        for _ in range(loops):
            for block, before in zip(blocks, start, strict=True):
                block[:] = before
            answered_states(*arguments)

    return run


def _in_c(exported: Exported, flown: tuple[Any, ...]) -> Competitor:
    sources = {**exported.sources, PurePosixPath("src/loop.c"): LOOP}
    library = ctypes.CDLL(str(build_library(sources, FLAGS)))
    library.space_robot_state_size.restype = ctypes.c_uint64
    state = np.zeros(library.space_robot_state_size() // 8)
    arrays = state, *flown[2:]

    def run(loops: int) -> None:
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
        for _ in range(loops):
            library.space_robot_init(pointers[0])
            library.answered_states(*pointers, ctypes.c_int64(TICKS))

    return run


def _sizes(exported: Exported) -> str:
    """Return bytes of code with constants, of state, and of the deepest stack."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = write_sources(folder, exported.sources)
        includes = [f"-I{folder / 'include'}", f"-I{folder}"]
        flags = ["-Os" if flag == "-O2" else flag for flag in FLAGS]
        command = ["cc", *flags, "-fstack-usage", *includes, "-c", *files]
        subprocess.run(command, cwd=folder, check=True)
        objects = [str(path) for path in folder.glob("*.o")]
        table = subprocess.check_output(["size", "-t", *objects], text=True)
        usage = "".join(path.read_text() for path in folder.glob("*.su"))
    code = int(table.splitlines()[-1].split()[0])
    frames = {name: int(size) for name, size in re.findall(r":(\w+)\t(\d+)\t", usage)}
    state = exported.figures()["state_bytes"]
    return f"{code} bytes of code (-Os), {state} of state, {_deepest(exported, frames)} of stack"


def _deepest(exported: Exported, frames: dict[str, int]) -> int:
    """Return bytes of the deepest chain of calls; what the compiler has inlined has no frame."""
    files, program = exported.translated.files, exported.translated.program

    @cache
    def depth(function: Function) -> int:
        called = (program.functions[int(k)] for k in CALL.findall("\n".join(function.lines)))
        return frames.get(files.name_of(function), 0) + max(map(depth, called), default=0)

    outside = sum(frames.get(f"space_robot_{name}", 0) for name in ("step", "answer"))
    return outside + max(map(depth, files.functions))
