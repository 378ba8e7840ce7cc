"""The code of docs/manual/python.md and of README runs as it stands there, block after block."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from paths import DOCS, ROOT

BLOCK = re.compile(r"```python( gym)?\n(.*?)```", re.DOTALL)


def blocks(of_gym: bool) -> list[str]:
    text = (DOCS / "manual/python.md").read_text("utf-8")
    return [code for gym, code in BLOCK.findall(text) if bool(gym) == of_gym]


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What the blocks, but Gymnasium's, have made."""
    found: dict[str, Any] = {}
    for code in blocks(of_gym=False):
        exec(compile(code, "python.md", "exec"), found)
    return found


def test_the_blocks_run(names: dict[str, Any]) -> None:
    assert len(blocks(of_gym=False)) == 7
    bench = names["bench"]
    assert bench.outcome == "complete"
    assert bench.tick == bench.ticks == 60_000
    error = bench.reference.joint_positions - bench.truth.joint_positions
    assert abs(error).max() < 0.01


def test_the_block_of_gymnasium_runs(names: dict[str, Any]) -> None:
    pytest.importorskip("gymnasium")
    tracking, reach = blocks(of_gym=True)
    found = {"Scenario": names["Scenario"]}
    exec(compile(tracking, "python.md", "exec"), found)
    assert found["is_over"]
    exec(compile(reach, "python.md", "exec"), found)
    assert found["observations"].shape == (16, 18)


def test_the_lines_of_readme_fly_three_laws_and_show_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser")
    opened: list[str] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda url: bool(opened.append(url)) or True)
    ((_, code),) = BLOCK.findall((ROOT / "README.md").read_text("utf-8"))
    exec(compile(code, "README.md", "exec"), {})
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows[:3]] == ["tde_stc", "ctc", "ctc_smc"]
    assert all(0.0 < float(error) < 1e-2 for row in rows[:3] for error in row[1:])
    assert {"tde_stc.png", "tde_stc.svg"} < {file.name for file in tmp_path.iterdir()}
    assert len(opened) == 1
