"""The cache of compiled code where it cannot be kept: it goes elsewhere, or is done without."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from space_robot_msgs_py.compiled.cache import _temporary_cache

PROGRAM = """
import sys
import numpy as np
from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.bag.kernels import walk_messages
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
    return subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def check_elsewhere(tmp_path: Path, cache: Path, why: str) -> None:
    done = run(tmp_path, cache)
    assert done.returncode == 0, done.stderr
    other = tmp_path / f"space_robot_{os.getuid()}"
    (line,) = done.stderr.splitlines()
    assert (
        line == f"space_robot: compiled code is stored in {other}: {cache} cannot be used ({why})"
    )
    assert done.stdout.startswith(f"6.0 {other}/")
    assert list(other.rglob("*.nbc"))


def test_a_folder_that_cannot_be_made_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    check_elsewhere(tmp_path, tmp_path / "file" / "cache", "Not a directory")


@pytest.mark.parametrize(
    ("options", "why"), [("ro", "Read-only file system"), ("size=100k", "no space left")]
)
def test_a_full_or_read_only_folder_is_replaced(tmp_path: Path, options: str, why: str) -> None:
    folder = tmp_path / "mounted"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("nothing may be mounted here")
    try:
        check_elsewhere(tmp_path, folder, why)
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


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
