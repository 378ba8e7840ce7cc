"""What is told of a process that has ended."""

from __future__ import annotations

import os
import sys
import time

from space_robot.flight.graph.processes import TAIL_LINES, NodeProcess


def test_an_error_is_told_though_much_was_said_after_it() -> None:
    """In a process of several nodes the others end after the one that failed, each with a word."""
    words = "; ".join(f"print('word {k}')" for k in range(2 * TAIL_LINES))
    code = f"print('plant_node: error: the flight diverged'); {words}; raise SystemExit(1)"
    process = NodeProcess("composed", [sys.executable, "-c", code], os.environ)
    try:
        while process.exit_code is None:
            time.sleep(0.005)
        first, *rest = str(process.early_end()).splitlines()[1:]
    finally:
        process.stop()
        process.close()
    assert first.strip() == "plant_node: error: the flight diverged"
    assert [line.strip() for line in rest] == [
        f"word {k}" for k in range(TAIL_LINES, 2 * TAIL_LINES)
    ]
