"""Which kernels a kernel needs: what the progress of compiling them is counted of."""

from __future__ import annotations

from pathlib import Path

import numba

from space_robot_msgs_py.compiled.call_graph import count_compiled, index_files
from space_robot_msgs_py.compiled.kernels import kernel, subroutine


@kernel
def leaf(x: float) -> float:
    return x + 1.0


@kernel
def unused(x: float) -> float:
    return x


@subroutine
def within(x: float) -> float:
    return leaf(x)


@kernel
def top(x: float) -> float:
    return within(x) + sum([leaf(v) for v in (x, x)])


def test_kernels_are_counted_through_subroutines_once_each() -> None:
    files = index_files([top, leaf])
    assert sorted(Path(file).name.split("-")[0] for file in files) == [
        "test_call_graph.leaf",
        "test_call_graph.top",
    ]
    assert index_files([within]) == index_files([leaf])
    assert not files & index_files([unused])


def test_a_kernel_counts_once_it_is_compiled() -> None:
    files = index_files([leaf])
    for file in files:
        Path(file).unlink(missing_ok=True)
    assert count_compiled(files) == 0
    assert leaf(1.0) == 2.0
    assert count_compiled(files) == 1


def test_a_function_without_a_cache_has_no_file() -> None:
    assert index_files([numba.njit(lambda x: x)]) == set()
