"""What is compiled: all of it after an installation, nothing for a robot of another size."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from paths import TESTS

from ..measure import Options
from ..result import Result, Target

SEEN, NEVER_SEEN = 6, (5, 8, 11)
"""Joints of the robot that everything is compiled with, and of others."""
ASKED = Target(10.0)
FLY = (sys.executable, "-m", "benchmarks.first_flight")


def compile(options: Options) -> list[Result]:
    """A process that flies a robot's first ticks, in a cache of its own.

    Empty at first, it then knows robots of one size alone.
    """
    with TemporaryDirectory(prefix="space_robot_bench_") as cache:
        options.progress("nothing is compiled (a minute)")
        everything = _first_ticks_s(SEEN, cache)
        seen, never_seen = [], []
        before = _functions(cache)
        for joints in NEVER_SEEN:
            options.progress(f"{joints} joints, never seen, beside {SEEN}")
            never_seen.append(_first_ticks_s(joints, cache))
            seen.append(_first_ticks_s(SEEN, cache))
        note = f"{_functions(cache) - before} functions compiled"
    usual = f"first ticks, {SEEN} joints"
    return [
        Result.timed("first ticks, nothing compiled", "s", [everything]),
        Result.timed(
            "first ticks, a size never seen",
            "s",
            never_seen,
            (usual, seen),
            options.asked(ASKED),
            note,
        ),
    ]


def _first_ticks_s(joints: int, cache: str) -> float:
    paths = os.pathsep.join([str(TESTS), *filter(None, sys.path)])
    begin = time.perf_counter()
    subprocess.run(
        [*FLY, str(joints)],
        check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPATH": paths},
    )
    return time.perf_counter() - begin


def _functions(cache: str) -> int:
    return len(list(Path(cache).rglob("*.nbc")))
