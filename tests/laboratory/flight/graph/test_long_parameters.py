"""Parameters that no command line can hold: `ros2 run` gets them in a file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from space_robot.flight.graph import orchestrator, processes


@pytest.mark.parametrize("length", [10, 200_000])
def test_a_long_parameter_is_in_a_file(
    length: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "has_ros2_run", lambda: True)
    values = {"disturbance.table": "1" * length, "period": 0.0005}
    command = orchestrator._command("plant", values, "/sat1", tmp_path)
    assert not isinstance(command, processes.Program)
    assert command[:4] == ["ros2", "run", "space_robot", "plant_node"]
    assert "__ns:=/sat1" in command
    if length < 100_000:
        assert "period:=0.0005" in command
        return
    assert max(map(len, command)) < 1_000
    file = Path(command[command.index("--params-file") + 1])
    assert json.loads(file.read_text()) == {"/**/plant_node": {"ros__parameters": values}}
