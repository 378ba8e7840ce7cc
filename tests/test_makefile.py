"""The first command of README, as it is typed: `make fly`."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from flights import ros_environment
from paths import ROOT

pytest.importorskip("rclpy")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_fly_flies_and_prints_the_table(free_domain: int, tmp_path: Path) -> None:
    """In the tests' own environment: that of a new clone is set up before the tests run."""
    options = f"--duration 0.2 --domain {free_domain} --bag {tmp_path / 'bag'}"
    command = ["make", "-o", f"{sys.prefix}/.flies", "fly", f"VENV={sys.prefix}", f"ARGS={options}"]
    made = subprocess.run(
        command, cwd=ROOT, env=ros_environment(), capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    assert "tde_stc, case 1, gains default: 400 ticks, 0.2 s" in made.stdout
    assert "messages lost: none" in made.stdout
