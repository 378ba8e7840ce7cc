"""Kernels translated to C one by one, compiled and called beside their originals."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Any

import jinja2
import numpy as np
import pytest

from space_robot_control.flight_code.c99 import language as lang
from space_robot_control.flight_code.c99.program import KernelProgram
from space_robot_control.flight_code.compiler import build_library
from space_robot_control.flight_code.files import Files
from space_robot_control.flight_code.folder import FLAGS, WARNINGS

needs_compiler = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler is installed"
)
CTYPES = {lang.FLOAT: ctypes.c_double, lang.INT: ctypes.c_int64, lang.BOOL: ctypes.c_bool}


def text_of(*signatures: tuple[Any, ...]) -> str:
    """The C of kernels, each with the types of its arguments, and of all that they call."""
    program = KernelProgram({}, 3)
    functions = []
    for kernel, *kinds in signatures:
        values = tuple(lang.Value(kind, "given") for kind in kinds)
        functions.append(program.functions[program.function(kernel.py_func, values)])
    files = Files(program, functions, [], lambda _: "all")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("space_robot_control.flight_code"), autoescape=False
    )
    header = environment.get_template("kernels.h.j2").render(
        constants=files.constants(), tuples=files.tuples(), prototypes=files.prototypes()
    )
    header = header.replace(
        '#include "space_robot_flight.h"', "#include <stdbool.h>\n#include <stdint.h>"
    )
    return files.final(header) + files.rooms()["all"]


def in_c(*signatures: tuple[Any, ...]) -> dict[Any, Callable[..., Any]]:
    """Kernels by themselves, compiled together by the system's compiler; arrays are float64."""
    text = text_of(*signatures)
    flags = (*FLAGS, *WARNINGS, "-Wno-unused-function")
    library = ctypes.CDLL(str(build_library({PurePosixPath("kernel.c"): text}, flags)))
    return {kernel: _call_of(library, kernel, kinds) for kernel, *kinds in signatures}


def _call_of(library: ctypes.CDLL, kernel: Any, kinds: list[Any]) -> Callable[..., Any]:
    function = getattr(library, f"sr_{kernel.py_func.__name__.lstrip('_')}")
    result = kernel.py_func.__annotations__["return"]
    function.restype = {"float": ctypes.c_double, "int": ctypes.c_int64, "None": None}[result]

    def call(*arguments: Any) -> Any:
        given = []
        for kind, argument in zip(kinds, arguments, strict=True):
            if isinstance(argument, np.ndarray):
                given.append(ctypes.c_void_p(argument.ctypes.data))
            else:
                given.append(CTYPES[kind](argument))
        return function(*given)

    return call


def same_bits(one: float, other: float) -> bool:
    """Whether two floats have the same bits; any NaN is as good as another."""
    if one != one:
        return other != other
    return np.float64(one).tobytes() == np.float64(other).tobytes()
