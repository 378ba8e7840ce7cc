"""How fast it all is, each figure beside its competitor: ``python tests/benchmarks --help``."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.command import bench

if __name__ == "__main__":
    bench(prog_name="python tests/benchmarks")
