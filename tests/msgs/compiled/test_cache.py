"""The folder of compiled kernels belongs to one state of their source."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

SHOW = "from space_robot_msgs_py.compiled.cache import cache_directory; print(cache_directory())"


def folder_of(root: Path, cache: Path) -> str:
    return subprocess.check_output(
        [sys.executable, "-B", "-c", SHOW],
        text=True,
        cwd=root,
        env={"PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(cache), "PATH": "/usr/bin:/bin"},
    ).strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    root = tmp_path / "root"
    for package in ("space_robot_msgs_py", "space_robot_model"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("*.pyc"))
    return root


def test_a_kernel_that_changes_has_another_folder_and_other_code_has_not(
    copy: Path, tmp_path: Path
) -> None:
    first = folder_of(copy, tmp_path)
    assert Path(first).parent == tmp_path

    def changed(name: str) -> bool:
        file = copy / name
        text = file.read_text()
        file.write_text(text + "\n# one line more\n")
        now = folder_of(copy, tmp_path)
        file.write_text(text)
        return now != first

    assert changed("space_robot_model/dynamics/aba.py")
    assert changed("space_robot_msgs_py/compiled/records.py")
    assert not changed("space_robot_model/robot/file.py")
    assert not changed("space_robot_msgs_py/errors.py")
    assert folder_of(copy, tmp_path) == first
