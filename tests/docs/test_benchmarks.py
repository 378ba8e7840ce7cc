"""The benchmarks run, one section a module, once and short: what they print is no measurement."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from flights import ros_environment
from paths import ROOT

pytestmark = [pytest.mark.docs, pytest.mark.ros]
BENCHMARKS = ROOT / "tools/benchmarks"


def test_the_benchmarks_run(tmp_path: Path) -> None:
    """But for those whose peers are not installed, which it says."""
    pytest.importorskip("rclpy")
    sections = ("plant", "flight-code", "lanes", "graph", "peers")
    words = [*sections, "--short", "--repetitions", "1", "--output", tmp_path / "samples.json"]
    command = [sys.executable, BENCHMARKS, *words]
    environment = ros_environment()
    ran = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    flown = json.loads((tmp_path / "samples.json").read_text("utf-8"))["sections"]
    left_out = re.findall(r"^([\w-]+) is left out: no ", ran.stderr, re.MULTILINE)
    assert "plant" in flown
    assert {*flown, *left_out} == {*sections}
    for section, rows in flown.items():
        assert rows, section
        for row in rows:
            assert all(math.isfinite(x) for samples in row["samples"].values() for x in samples)
