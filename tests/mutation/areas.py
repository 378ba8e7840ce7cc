"""Which code is mutated, and which tests must notice: those near it, not whole flights."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Area(NamedTuple):
    """Patterns of files below the root."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]

    def modules(self) -> Iterator[Path]:
        """Modules that may be mutated, relative to the root."""
        for pattern in self.sources:
            found = (path.relative_to(ROOT) for path in _found(pattern))
            yield from (path for path in found if path.name != "__init__.py")

    def tests_of(self, module: Path) -> list[str]:
        """Tests of the area, those that bear the module's name first."""
        tests = [path.relative_to(ROOT) for pattern in self.tests for path in _found(pattern)]
        return [str(path) for path in sorted(tests, key=lambda test: module.stem not in test.stem)]


def _found(pattern: str) -> list[Path]:
    if not (found := sorted(ROOT.glob(pattern))):
        raise LookupError(f"no file is named {pattern}")
    return found


SIM, CONTROL, MSGS = "space_robot_sim", "space_robot_control", "space_robot_msgs_py"
AREAS = {
    "laws": Area(
        (f"{CONTROL}/laws/*.py",),
        ("tests/control/test_laws.py", "tests/control/test_compiled_loop.py",
         "tests/control/test_controller.py",
         "tests/control/test_takeover.py", "tests/control/test_closed_loop.py"),
    ),
    "controller": Area(
        (f"{CONTROL}/controller.py", f"{CONTROL}/controller_kernels.py",
         f"{CONTROL}/time_delay_estimation.py", f"{CONTROL}/tracking.py",
         f"{CONTROL}/law_set.py", f"{CONTROL}/reference.py"),
        ("tests/control/test_controller.py", "tests/control/test_time_delay_estimation.py",
         "tests/control/test_tracking.py", "tests/control/test_takeover.py",
         "tests/control/test_swaps.py", "tests/control/test_reference.py",
         "tests/control/test_compiled_loop.py",
         "tests/control/test_closed_loop.py"),
    ),
    "dynamics": Area(
        (f"{SIM}/dynamics/*.py", f"{SIM}/attitude.py", f"{SIM}/integrator.py",
         f"{SIM}/environment.py"),
        ("tests/sim/test_attitude.py", "tests/sim/test_equations_of_motion.py",
         "tests/sim/test_forward_dynamics.py", "tests/sim/test_rho_space.py",
         "tests/sim/test_conservation.py", "tests/sim/test_environment.py",
         "tests/sim/test_plant.py"),
    ),
    "guards": Area(
        (f"{CONTROL}/supervisor.py", f"{MSGS}/stamp_guard.py", f"{SIM}/command_guard.py"),
        ("tests/control/test_supervisor.py", "tests/msgs/test_stamp_guard.py",
         "tests/sim/test_command_guard.py"),
    ),
    "metrics": Area(
        (f"{CONTROL}/analysis/metrics.py", f"{CONTROL}/analysis/actuation.py",
         f"{CONTROL}/analysis/settling.py", f"{CONTROL}/analysis/pointing.py",
         f"{CONTROL}/analysis/estimate_error.py", f"{CONTROL}/analysis/waypoints.py",
         f"{CONTROL}/analysis/spectrum.py", f"{CONTROL}/analysis/blocks.py",
         f"{CONTROL}/analysis/report.py", f"{CONTROL}/analysis/generalised_motion.py",
         f"{CONTROL}/analysis/excerpt.py", f"{CONTROL}/analysis/table.py"),
        ("tests/control/test_metrics.py", "tests/control/test_actuation.py",
         "tests/control/test_settling.py", "tests/control/test_waypoints.py",
         "tests/control/test_pointing.py",
         "tests/control/test_estimate_error.py", "tests/control/test_blocks.py",
         "tests/control/test_excerpt.py", "tests/control/test_table.py"),
    ),
    "bag": Area(
        (f"{MSGS}/bag/*.py",),
        ("tests/msgs/test_bag*.py", "tests/msgs/test_coverage.py", "tests/msgs/test_mcap*.py",
         "tests/msgs/test_sources.py", "tests/msgs/test_faulty_flights.py",
         "tests/msgs/test_rosbag2_yaml.py", "tests/msgs/test_unfinished_bag.py",
         "tests/msgs/test_broken_bags.py", "tests/sim/test_load_bag.py"),
    ),
    "wire": Area(
        (f"{MSGS}/cdr.py", f"{MSGS}/compiled_cdr.py", f"{MSGS}/codecs.py",
         f"{MSGS}/reference_codec.py", f"{MSGS}/plain_codecs.py", f"{MSGS}/decoded.py",
         f"{MSGS}/samples.py"),
        ("tests/msgs/test_cdr.py", "tests/msgs/test_codecs.py",
         "tests/msgs/test_reference_codec.py", "tests/msgs/test_foreign_messages.py",
         "tests/msgs/test_wire.py"),
    ),
}  # fmt: skip
