"""What starts often starts soon: nodes and commands import nothing slow that they do not need."""

from __future__ import annotations

import sys

import pytest
from command import run_program

SLOW = {"matplotlib", "scipy.spatial", "scipy.signal", "scipy.optimize", "pyarrow"}
"""A tenth of a second of the processor's and more each; five processes start for a flight."""


@pytest.mark.parametrize(
    ("modules", "slow"),
    [
        ("space_robot_control.mission_node, space_robot_msgs_py.recorder_node", {*SLOW, "numba"}),
        ("space_robot_control.controller_node, space_robot_sim.plant_node", SLOW),
        ("space_robot.flight.graph.orchestrator, space_robot.api", SLOW),
        ("space_robot.cli.main", {*SLOW, "numba", "numpy", "pydantic", "yaml"}),
    ],
)
def test_slow_libraries_are_imported_where_they_are_used(modules: str, slow: set[str]) -> None:
    if "_node" in modules:
        pytest.importorskip("rclpy")
    code = f"import sys, {modules}; "
    if "cli" in modules:  # what a shell asks for with each press of Tab
        code += "from click.shell_completion import ShellComplete as S; "
        code += "S(space_robot.cli.main.cli, {}, 'x', 'X').get_completions(['robot'], ''); "
    code += f"print(*sorted({slow!r} & set(sys.modules)))"
    done = run_program([sys.executable, "-c", code])
    assert (done.stdout, done.returncode) == ("\n", 0), done.stderr
