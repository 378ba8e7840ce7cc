"""The flight code in C beside its kernels: time of a tick, bytes of code, state and stack."""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from space_robot.export.software import export
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.flight_code.c99.functions import Function
from space_robot_control.flight_code.c99.program import CALL
from space_robot_control.flight_code.compiler import build_library, write_sources
from space_robot_control.flight_code.folder import FLAGS, Exported
from space_robot_control.flight_code.library import fill_measurement, measurement_of
from space_robot_control.laws import CompiledLaw, laws
from space_robot_msgs_py.samples import Reference

from ..kernels import answered_states
from ..measure import Options, interleave
from ..result import Result, Target

SETTINGS: tuple[dict[str, Any], ...] = (
    {},
    {"navigation": "filtered", "sensors": "fine", "actuators": "wheels"},
)
"""Of the flights: ideal, and all that the flight software has."""
TICKS = 400
FAST = ("-std=c99", "-O3", "-march=native", "-ffp-contract=off")
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


class Flown(NamedTuple):
    """What the controller of a flight was given."""

    states: Any
    references: Any
    measurements: Any
    """The states as C takes them."""
    wanted: Any
    """The references as C takes them."""


def flight_code(options: Options) -> list[Result]:
    """Every law, ideal and with navigation and wheels."""
    results = []
    for settings in SETTINGS[:1] if options.short else SETTINGS:
        for law in sorted(laws()):
            options.progress(f"{law}, {settings.get('actuators', 'ideal')}")
            results += _law(law, settings, options)
    return results


def _law(law: str, settings: dict[str, Any], options: Options) -> list[Result]:
    plan = FlightPlan(controller=law, duration=TICKS * 5e-4, **settings)
    exported = export(Flight(resolve(plan)))
    flown = _flown(plan, exported)
    competitors = {
        "Numba": _numba(plan, flown),
        "-O2": _in_c(exported, flown, FLAGS),
        "-O3 -march=native": _in_c(exported, flown, FAST),
    }
    seconds = interleave(competitors, options.batches(), batch_s=options.batch_s)
    tick = {name: [s / TICKS for s in times] for name, times in seconds.items()}
    about = " with navigation and wheels" if settings else ""
    beside, note = ("Numba", tick["Numba"]), _sizes(exported)
    asked = options.asked(Target(1.0, of="ratio"))
    return [
        Result.timed(f"{law}{about}, cc -O2", "ns", tick["-O2"], beside, asked, note),
        Result.timed(
            f"{law}{about}, cc -O3 -march=native", "ns", tick["-O3 -march=native"], beside
        ),
    ]


def _flown(plan: FlightPlan, exported: Exported) -> Flown:
    flight = Flight(resolve(plan))
    references = flight.mission.chunk(0, TICKS).references()
    states = np.zeros(TICKS, flight.plant.state.block.dtype)
    measurements = np.zeros(TICKS, measurement_of(exported).dtype)
    wanted = np.zeros(TICKS, np.dtype(exported.translated.dtype(Reference)))
    for name in wanted.dtype.names or ():
        wanted[name] = references[name]
    for k in range(TICKS):
        state = flight.plant.state
        states[k] = state.block[0]
        fill_measurement(measurements[k : k + 1], state)
        flight.plant.step(flight.controller.update(state, references[k : k + 1]))
    return Flown(states, references, measurements, wanted)


def _numba(plan: FlightPlan, flown: Flown) -> Callable[[int], object]:
    flight = Flight(resolve(plan))
    controller, law = flight.controller, flight.law
    assert isinstance(law, CompiledLaw)
    supervision = Supervisor(controller, hold_ticks=200).block
    code, allocate = law.code, controller.allocate
    blocks = (supervision, controller.block, law.memory_block)
    start = [block.copy() for block in blocks]

    def run(loops: int) -> None:
        for _ in range(loops):
            for block, before in zip(blocks, start, strict=True):
                block[:] = before
            answered_states(
                supervision,
                controller.block,
                code,
                allocate,
                flown.states,
                flown.references,
                controller.period,
            )

    return run


def _in_c(exported: Exported, flown: Flown, flags: tuple[str, ...]) -> Callable[[int], object]:
    sources = {**exported.sources, PurePosixPath("src/loop.c"): LOOP}
    library = ctypes.CDLL(str(build_library(sources, flags)))
    library.space_robot_state_size.restype = ctypes.c_uint64
    state = np.zeros(library.space_robot_state_size() // 8)

    def run(loops: int) -> None:
        arrays = state, flown.measurements, flown.wanted
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
        for _ in range(loops):
            library.space_robot_init(pointers[0])
            library.answered_states(*pointers, ctypes.c_int64(TICKS))

    return run


def _sizes(exported: Exported) -> str:
    """Bytes of code with constants, of state, and of the deepest stack."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = write_sources(folder, exported.sources)
        includes = [f"-I{folder / 'include'}", f"-I{folder}"]
        flags = ["-Os" if flag == "-O2" else flag for flag in FLAGS]
        command = ["cc", *flags, "-fstack-usage", *includes, "-c", *files]
        subprocess.run(command, cwd=folder, check=True)
        objects = [str(path) for path in folder.glob("*.o")]
        table = subprocess.run(["size", "-t", *objects], capture_output=True, text=True, check=True)
        code = int(table.stdout.splitlines()[-1].split()[0])
        usage = "".join(path.read_text() for path in folder.glob("*.su"))
        frames = {name: int(size) for name, size in re.findall(r":(\w+)\t(\d+)\t", usage)}
    state = exported.figures()["state_bytes"]
    return f"{code} bytes of code (-Os), {state} of state, {_deepest(exported, frames)} of stack"


def _deepest(exported: Exported, frames: dict[str, int]) -> int:
    """Bytes of the deepest chain of calls; what the compiler has inlined has no frame."""
    files = exported.translated.files

    @cache
    def depth(function: Function) -> int:
        own = frames.get(files.name_of(function), 0)
        numbers = CALL.findall("\n".join(function.lines))
        called = (depth(exported.translated.program.functions[int(k)]) for k in numbers)
        return own + max(called, default=0)

    outside = sum(frames.get(f"space_robot_{name}", 0) for name in ("step", "answer"))
    return outside + max(map(depth, files.functions))
