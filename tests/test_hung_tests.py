"""A test that hangs, or ends its process, fails; all others are run, once each."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from paths import TESTS

pytest.importorskip("xdist")

PLAIN = "def test_one(): pass\n"
HANGING = """
import ctypes, os, pytest, time

def test_before(): pass

def test_hangs():
    if not os.fork():
        time.sleep(60.0)  # with the pipe to the controlling process open
    ctypes.CDLL(None).sleep(60)

def test_between(): pass

@pytest.fixture
def hanging():
    yield
    time.sleep(60.0)

def test_fails(hanging): assert False

def test_ends_its_process(): os._exit(0)

def test_last(): pass
"""


@pytest.mark.slow
def test_a_test_that_hangs_fails_and_the_others_are_run(tmp_path: Path) -> None:
    """Those of its file, too, though its process has done other files."""
    (tmp_path / "pytest.ini").touch()
    (tmp_path / "conftest.py").write_text("import hung_tests\nhung_tests.HUNG_S = 3.0\n")
    for k in range(6):
        (tmp_path / f"test_{k}.py").write_text(HANGING if k == 4 else PLAIN)
    paths = [str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])]
    options = "-rA -p hung_tests -n 1 --dist loadfile --no-loadscope-reorder"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options.split()],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    results = Counter(line.split(" - ")[0] for line in done.stdout.splitlines() if "::" in line)
    plain = [f"PASSED test_{k}.py::test_one" for k in (0, 1, 2, 3, 5)]
    passed = [f"PASSED test_4.py::test_{name}" for name in ("before", "between", "last")]
    failed = [f"FAILED test_4.py::test_{name}" for name in ("hangs", "fails", "ends_its_process")]
    for line in (*plain, *passed, *failed):
        assert results[line] == 1 + line.endswith("fails"), (line, done.stdout)  # and its fixture
    assert done.stderr.count("most recent call first") >= 2
    assert "in test_hangs" in done.stderr
    assert "in hanging" in done.stderr
