"""The cache of compiled code: one folder a state of the source, elsewhere if it cannot be kept."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from command import run_program
from numpy.typing import NDArray
from paths import ROOT

from space_robot_msgs_py.compiled.cache import _temporary_cache, count_compiled, index_files
from space_robot_msgs_py.compiled.kernels import kernel, subroutine

PROGRAM = """
import sys
import numpy as np
from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.bag.batch import walk_messages
exec(compile(open({file!r}).read(), {file!r}, "exec"))
print(double(np.arange(3.0)).sum(), cache_directory(), *{{"scipy.linalg"}} & set(sys.modules))
"""
KERNEL = """
from space_robot_msgs_py.compiled.kernels import kernel
@kernel
def double(values):
    return 2.0 * values
"""


def run(tmp_path: Path, cache: Path) -> subprocess.CompletedProcess[str]:
    (tmp_path / "some_kernel.py").write_text(KERNEL)
    program = PROGRAM.format(file=str(tmp_path / "some_kernel.py"))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "TMPDIR": str(tmp_path)}
    return run_program([sys.executable, "-c", program], env=environment)


@pytest.mark.parametrize(
    ("options", "why"), [("", "Not a directory"), ("size=100k", "no space left")]
)
def test_a_folder_that_is_none_or_full_is_replaced(tmp_path: Path, options: str, why: str) -> None:
    cache = tmp_path / "cache"
    if not options:
        (tmp_path / "file").touch()
        cache = tmp_path / "file" / "cache"
    else:
        cache.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", options, "none", str(cache)]
        if subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip("nothing may be mounted here")
    try:
        done = run(tmp_path, cache)
    finally:
        if options:
            subprocess.run(["umount", "-l", str(cache)], check=True)
    assert done.returncode == 0, done.stderr
    other = tmp_path / f"space_robot_{os.getuid()}"
    said = f"space_robot: compiled code is stored in {other}: {cache} cannot be used ({why})"
    assert done.stderr.splitlines() == [said]
    assert done.stdout.startswith(f"6.0 {other}/")
    assert list(other.rglob("*.nbc"))


def test_what_is_in_the_cache_needs_no_compiler(tmp_path: Path) -> None:
    """Numba compiles with SciPy's linear algebra, and a command should not wait for that."""
    first, second = (run(tmp_path, tmp_path / "cache").stdout.split() for _ in range(2))
    assert [first[0], first[2:]] == ["6.0", ["scipy.linalg"]]
    assert [second[0], second[2:]] == ["6.0", []]


def test_the_temporary_folder_is_nobody_elses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    mine = _temporary_cache()
    assert mine == tmp_path / f"space_robot_{os.getuid()}"
    assert mine.stat().st_mode & 0o777 == 0o700
    mine.rmdir()
    (tmp_path / "trap").mkdir()
    mine.symlink_to(tmp_path / "trap")  # somebody was here first
    assert _temporary_cache() != mine


NAMES = """
from space_robot_msgs_py.compiled.record_type import RecordType
from space_robot_model.dynamics.rho_space import RhoSpaceModel
from space_robot_sim.plant.tick import PlantMemory
for record in {records}:
    print(record.__name__, RecordType(record.layout()).mangling_args)
"""


def test_records_have_the_same_name_in_machine_code_whichever_process_compiles_it() -> None:
    """A process may load what two others have compiled: one name must be one layout."""
    orders = ("RhoSpaceModel, PlantMemory", "PlantMemory, RhoSpaceModel")
    first, second = (
        subprocess.check_output([sys.executable, "-c", NAMES.format(records=records)], text=True)
        for records in orders
    )
    assert sorted(first.splitlines()) == sorted(second.splitlines())
    one, other = (line.split(maxsplit=1)[1] for line in first.splitlines())
    assert one != other


SHOW = "from space_robot_msgs_py.compiled.cache import cache_directory; print(cache_directory())"


def test_a_kernel_that_changes_has_another_folder_and_other_code_has_not(tmp_path: Path) -> None:
    root = tmp_path / "root"
    for package in ("space_robot_msgs_py", "space_robot_model", "space_robot_sim"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("*.pyc"))

    def folder() -> str:
        return subprocess.check_output(
            [sys.executable, "-B", "-c", SHOW],
            text=True,
            cwd=root,
            env={
                "PYTHONPATH": str(root),
                "NUMBA_CACHE_DIR": str(tmp_path),
                "PATH": "/usr/bin:/bin",
            },
        ).strip()

    first = folder()
    assert Path(first).parent == tmp_path
    for name, old, new, is_kernel in (
        ("space_robot_model/dynamics/aba.py", "\n", "\n\n", True),
        ("space_robot_msgs_py/compiled/records.py", "\n", "\n\n", True),
        ("space_robot_msgs_py/samples.py", " = 8, 24, 6", " = 9, 24, 6", True),
        ("space_robot_model/robot/files.py", "\n", "\n\n", False),
        ("space_robot_msgs_py/errors.py", "\n", "\n\n", False),
    ):
        text = (root / name).read_text()
        assert old in text
        (root / name).write_text(text.replace(old, new))
        assert (folder() != first) == is_kernel, name
        (root / name).write_text(text)
    assert folder() == first


# Which kernels a kernel needs: what the progress of compiling them is counted of


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


def test_kernels_are_counted_through_subroutines_once_each_when_compiled() -> None:
    files = index_files([top, leaf])
    names = sorted(Path(file).name.split("-")[0] for file in files)
    assert names == ["test_compiled.leaf", "test_compiled.top"]
    assert index_files([within]) == index_files([leaf])
    assert not files & index_files([unused])
    assert index_files([numba.njit(lambda x: x)]) == set()
    files = index_files([leaf])
    for file in files:
        Path(file).unlink(missing_ok=True)
    assert count_compiled(files) == 0
    assert leaf(1.0) == 2.0
    assert count_compiled(files) == 1


# Assignment to parts of arrays, which is our own


@kernel
def assign(row: NDArray[np.float64], matrix: NDArray[np.float64]) -> None:
    row[1:] = row[:-1]
    row[0] = 7
    row[-3:-1] = row[-2:]
    matrix[1] = row[:3]
    matrix[:, 2] = row[:4]
    matrix[2:, :] = matrix[:2]
    matrix[0, 1:] = row[:2]
    matrix[3:] = 2
    matrix[2, :2] = row[3:4]
    matrix[::2] = 0.5


def test_parts_of_arrays_are_assigned_as_numpy_does_also_where_they_overlap() -> None:
    compiled, interpreted = ([np.arange(6.0), np.arange(12.0).reshape(4, 3)] for _ in range(2))
    assign(*compiled)
    assign.py_func(*interpreted)  # type: ignore[attr-defined]
    for ours, theirs in zip(compiled, interpreted, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@kernel
def shift(row: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    row[1:] = values


@pytest.mark.parametrize("size", [0, 2, 4])
def test_an_array_is_not_assigned_to_a_part_of_another_size(size: int) -> None:
    with pytest.raises(ValueError, match="part of another size"):
        shift(np.zeros(4), np.zeros(size))
