"""Modules as programs, without what lies in the current folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from space_robot_msgs_py.ros.run_module import HERE, clean_environment, module_command

SHOW = 'import json, sys; print(json.dumps({"argv": sys.argv[1:], "path": sys.path}))'


def _run(command: list[str], folder: Path, **environment: str) -> dict[str, list[str]]:
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


@pytest.fixture
def shadows(tmp_path: Path) -> Path:
    """A folder with modules of the names of others, as users have them."""
    folder = tmp_path / "shadows"
    folder.mkdir()
    for name in ("yaml", "queue", "numpy", "space_robot_sim", "runpy"):
        (folder / f"{name}.py").write_text("raise SystemExit('ran the code of this folder')\n")
    return folder


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """A folder on PYTHONPATH with a program that imports them."""
    folder = tmp_path / "programs"
    folder.mkdir()
    (folder / "show.py").write_text(f"import queue, yaml, numpy, space_robot_sim\n{SHOW}\n")
    return folder


def test_current_folder_is_not_searched(shadows: Path, program: Path) -> None:
    ours = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry]
    path = os.pathsep.join([str(program), *ours])
    found = _run(module_command("show", "-p", "a:=[1, 2]"), shadows, PYTHONPATH=path)
    assert found["argv"] == ["-p", "a:=[1, 2]"]
    assert str(shadows) not in found["path"]
    assert "" not in found["path"]
    assert HERE not in found["path"]  # nor the modules beside the program that runs modules
    assert str(program) in found["path"]


def test_empty_entry_of_the_python_path_is_no_current_folder(
    shadows: Path, program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As left behind by ``export PYTHONPATH=$MINE:$PYTHONPATH``."""
    ours = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", str(program), *ours, ""]))
    found = _run(module_command("show"), shadows, **clean_environment())
    assert str(shadows) not in found["path"]


def test_same_tree_is_found_where_it_is_not_installed(tmp_path: Path) -> None:
    module = module_command("space_robot_msgs_py.ros.lifeline")
    subprocess.run([sys.executable, "-I", "-S", *module[1:]], cwd=tmp_path, check=True)
