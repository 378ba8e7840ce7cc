"""A flight and its report have the same bits on processors that lack what this one has."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

FLIGHTS = {
    "wheels, a filter, friction": {
        "case": "3",
        "sensors": "fine",
        "navigation": "filtered",
        "actuators": "wheels",
        "duration": 1.5,
    },
    "slides, thrusters": {
        "robot": "ets_vii",
        "mission": "ets_vii",
        "actuators": "thrusters",
        "duration": 1.0,
    },
    "two arms": {"robot": "dual_arm", "mission": "dual_arm", "sensors": "coarse", "duration": 1.0},
}
CODE = f"""
import hashlib, json
from space_robot import Scenario
for name, options in {FLIGHTS!r}.items():
    flown = Scenario(**options).fly()
    parts = [flown.log, flown.log.measured] if flown.log.measured else [flown.log]
    columns = {{(i, k): v for i, part in enumerate(parts) for k, v in part.columns.items()}}
    for key, column in columns.items():
        print(name, *key, hashlib.sha256(column.tobytes()).hexdigest())
    print(name, json.dumps(flown.report(), sort_keys=True))
"""
C_LIBRARY = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL,-AVX2_Usable,-FMA_Usable"
"""This processor without what its sines are chosen by, in the words of old and new versions."""
MASK = {
    "GLIBC_TUNABLES": C_LIBRARY,
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX2 FMA3 AVX512F AVX512_SKX",
    "OPENBLAS_CORETYPE": "Prescott",
}
"""What the C library, NumPy and its matrix products are to believe of the processor."""


def flown(mask: dict[str, str]) -> list[str]:
    """Fly in a process of its own; its lines."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", CODE],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **mask},
        cwd=Path(__file__).parents[3],
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_every_number_of_flight_and_report_is_the_same() -> None:
    """On this processor, and on one that lacks most of what it has."""
    here, there = flown({}), flown(MASK)
    assert len(here) > 3 * len(FLIGHTS)
    assert [*zip(here, there, strict=True)] == [*zip(here, here, strict=True)]
