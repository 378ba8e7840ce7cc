"""The types of names in C are those that Numba infers for the kernels that fly."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from typing import Any

import numba
import pytest
from numba import types

from space_robot.export.software import export
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.flight_code.c99 import language as lang
from space_robot_control.flight_code.c99.functions import Function
from space_robot_msgs_py.compiled.record_type import record_type

FURTHER = ["ctc", "adrc"]
JOINTS = 6


DECLARED = re.compile(r"(?:const )?(double|int64_t|bool|sr_\w+) (\(?\*?)(\w+)\)?(?:\[\d+\])* ?[=;]")


ANNOTATED = re.compile(r"^\s*#\s+([A-Za-z_]\w*)(?:\.\d+)? = .*  :: (.+?)\s*$", re.MULTILINE)


def dispatchers() -> dict[Any, Any]:
    """Compiled kernels by the Python function they are of."""
    names = [name for name in sys.modules if name.startswith("space_robot")]
    values = (value for name in names for value in vars(sys.modules[name]).values())
    return {v.py_func: v for v in values if hasattr(v, "py_func") and hasattr(v, "overloads")}


def of_numba(kind: Any) -> Any:
    """Numba's type of an argument."""
    scalars = {lang.FLOAT: types.float64, lang.INT: types.int64, lang.BOOL: types.boolean}
    if isinstance(kind, lang.Scalar):
        return scalars[kind]
    if isinstance(kind, lang.Pointer):
        return record_type(kind.record.layout(), 1)
    if isinstance(kind, lang.BlockOf):
        return numba.typeof(kind.record.block(JOINTS))
    if isinstance(kind, lang.ArrayOf):
        return types.Array(types.float64, len(kind.shape), "C")
    assert isinstance(kind, lang.TupleOf)
    return types.Tuple([of_numba(item) for item in kind.items])


def inferred(function: Function, kernels: dict[Any, Any]) -> dict[str, set[str]]:
    """What Numba has inferred for each name, over all of its versions."""
    kinds = {parameter.name: parameter.type for parameter in function.parameters}
    arguments = [kinds.get(name) for name in inspect.signature(function.body).parameters]
    signature = tuple(types.boolean if k is None else of_numba(k) for k in arguments)
    kernel = kernels[function.body]
    kernel.compile(signature)
    annotation = kernel.overloads[signature].type_annotation
    if isinstance(annotation, str):  # from the cache
        pairs = ANNOTATED.findall(annotation)
    else:
        pairs = [(name, str(kind)) for name, kind in annotation.typemap.items()]
    names: dict[str, set[str]] = {}
    for name, kind in pairs:
        names.setdefault(name.split(".")[0], set()).add(kind)
    return names


def in_c(kinds: set[str]) -> str:
    """The type in C of a name that Numba has these types for."""
    results = (kind.rpartition("-> ")[2] for kind in kinds)  # of a call
    plain = (re.sub(r"Literal\[(\w+)\]", r"\1", kind).split("(")[0] for kind in results)
    words = {"int64" if word == "int" else word for word in plain}
    if words <= {"float64", "int64"}:
        return "double" if "float64" in words else "int64_t"
    if words == {"bool"}:
        return "bool"
    if words == {"array"}:
        return "double *"
    if words <= {"Tuple", "UniTuple"}:
        return "sr_tuple"
    return "sr_ *" if all(word.startswith("Record") for word in words) else str(kinds)


def declarations(function: Function) -> Iterator[tuple[str, str]]:
    """Each name declared in C, and its type."""
    for line in function.lines:
        match = DECLARED.search(re.sub(r"«\d+:(\w+)»", r"\1", line).replace("for (", "", 1))
        if match:
            word, pointer, name = match.groups()
            kind = word if not word.startswith("sr_") else "sr_tuple" if "tuple" in word else "sr_"
            yield name, f"{kind} *" if pointer else kind


@pytest.mark.slow
def test_names_have_the_types_that_numba_infers() -> None:
    settings = {"navigation": "filtered", "sensors": "fine", "actuators": "wheels_and_thrusters"}
    exported = export(Flight(resolve(FlightPlan(**settings))), FURTHER)
    kernels, checked, functions = dispatchers(), 0, 0
    for function in exported.translated.files.functions:
        bound = [k for k in function.arguments if not k]
        if len(bound) > 1 or any(len(names) > 1 for names in function.arguments):
            continue  # of a law: its function is bound
        found = inferred(function, kernels)
        functions += 1
        for name, kind in declarations(function):
            if name in found:  # not one of the translation's own
                assert in_c(found[name]) == kind, (function.body.__name__, name, found[name])
                checked += 1
    assert functions > 80
    assert checked > 400
