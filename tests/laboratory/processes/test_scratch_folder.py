"""Temporary folders: gone with their process, however it ends, and never one that is in use."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

from space_robot.processes.scratch_folder import NEW_S, PREFIX, ScratchFolder, remove_stale_folders


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def make_old(folder: Path) -> None:
    long_ago = time.time() - 2 * NEW_S
    os.utime(folder, (long_ago, long_ago))


def wait_for_the_end(end: Any) -> None:
    folder = ScratchFolder()
    (Path(folder.name) / "parameters.yaml").write_text("x")
    make_old(Path(folder.name))
    end.send(folder.name)
    time.sleep(600.0)


def test_the_folder_of_a_killed_process_goes_when_another_one_is_made() -> None:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=wait_for_the_end, args=(theirs,), daemon=True)
    process.start()
    folder = Path(ours.recv())
    with ScratchFolder():
        assert folder.exists()  # it is in use
    os.kill(process.pid or 0, signal.SIGKILL)
    process.join()
    with ScratchFolder() as other:
        assert not folder.exists()
        assert Path(other).is_dir()
    assert not Path(other).exists()


def test_what_is_not_its_own_or_new_stays(temporary: Path) -> None:
    new, other, file, target = (
        temporary / name for name in (f"{PREFIX}new", "scratch", f"{PREFIX}file", "target")
    )
    for folder in (new, other, target):
        folder.mkdir()
    file.write_text("x")
    (temporary / f"{PREFIX}link").symlink_to(target)
    for path in (other, file, target):
        make_old(path)
    with ScratchFolder():
        pass
    assert all(path.exists() for path in (new, other, file, target))


def test_looking_for_stale_folders_leaves_no_file_open(temporary: Path) -> None:
    stale = temporary / f"{PREFIX}stale"
    for _ in range(20):
        stale.mkdir()
        os.utime(stale, (time.time() - 2 * NEW_S,) * 2)
        remove_stale_folders()
        assert not stale.exists()
    assert not [path for path in open_files() if path.startswith(str(temporary))]


def open_files() -> list[str]:
    """Paths of this process's open files; a deleted one's has ' (deleted)' after it."""
    descriptors = Path("/proc/self/fd").iterdir()
    return [os.readlink(descriptor) for descriptor in descriptors if descriptor.is_symlink()]
