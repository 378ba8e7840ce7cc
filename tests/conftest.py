"""Fixtures and marks for all tests; the same examples of hypothesis on every run; what may lack."""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterable, Iterator, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

try:
    from hypothesis import HealthCheck, settings
    from hypothesis.internal.conjecture import providers
except ImportError:
    pass  # every module that needs it is skipped
else:
    # Else examples depend on which modules other tests have imported before.
    NO_CONSTANTS = providers._local_constants
    providers._get_local_constants = lambda: NO_CONSTANTS
    settings.register_profile(
        "ci", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
    )
    settings.load_profile("ci")

from command import Ran, Run
from flights import RESERVED, Flown, Start, ros_environment, space_robot_here
from forked import END_S, Forked
from paths import CONFIG, TESTS

from space_robot.flight.graph.domain import ros_domain
from space_robot.processes import MODULES
from space_robot_model.robot import Robot

if TYPE_CHECKING:
    from ground import Ground

ROBOTS = CONFIG / "robots"

TOOLS = (
    "cuda",
    "cvxpy",
    "gymnasium",
    "hypothesis",
    "msgspec",
    "mujoco",
    "nbclient",
    "nbformat",
    "pandas",
    "pinocchio",
    "psutil",
    "pyarrow",
    "trimesh",
    "viser",
)
"""Of the tests only. Where `colcon test` finds one missing, the modules that use it are skipped,
whichever of their helpers imports it."""


class _MissingTool:
    """The last finder asked for a module, so only if no other has found it."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> None:
        if name in TOOLS:
            pytest.skip(f"{name} is not installed", allow_module_level=True)


sys.meta_path.append(_MissingTool())


def forget_workspace(environment: MutableMapping[str, str]) -> None:
    """Let flights start the nodes of this checkout, in domains of their own.

    In the shell of a sourced workspace, and under `colcon test`, a node would be `ros2 run` with a
    child, in the user's domain, where others may be.
    """
    environment.pop("ROS_DOMAIN_ID", None)
    if prefixes := environment.get(PREFIXES):
        others = [p for p in prefixes.split(os.pathsep) if not (Path(p) / MARKER).exists()]
        environment[PREFIXES] = os.pathsep.join(others)


pytest_plugins = ["hung_tests"]

PREFIXES, MARKER = "AMENT_PREFIX_PATH", "share/ament_index/resource_index/packages/space_robot"
forget_workspace(os.environ)

OF_ROS = {"domain", "free_domain", "fly", "start", "ground"}
"""Fixtures of tests that start ROS processes, or are a node of their own."""
WITH_ROS = ("control/controller/test_law_changes.py", "laboratory/flight/graph/")
SLOW = (
    "control/flight_code/",
    "laboratory/campaign/",
    "laboratory/export/",
    "laboratory/paper/",
    "laboratory/trace/",
    "matrix/",
    "laboratory/cli/test_analyze_and_view.py",
    "laboratory/view/test_in_browser.py",
    "laboratory/flight/test_shipped_robots.py",
    "msgs/bag/test_broken_bags.py",
    "msgs/bag/test_description.py",
    "test_packaging.py",
    "test_shown_outputs.py",
)
"""Folders and files whose tests take seconds each."""
FLYING_UNTIL = 0.7
"""Part of the files after which none of the marked ones is left to begin."""
TIMEOUT_S = 600
"""Of each test, its fixtures included: kernels may have to be compiled first."""


def marks(where: str, fixtures: Iterable[str]) -> Iterator[str]:
    """The marks of a test in the file ``where``, relative to tests/, that uses ``fixtures``."""
    if where.startswith(WITH_ROS) or OF_ROS.intersection(fixtures):
        yield "ros"
    if where.startswith(SLOW):
        yield "slow"


def pytest_configure(config: pytest.Config) -> None:
    """Tell of the marks, and heed SIGINT: what is started in a shell's background does not."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    config.addinivalue_line("markers", "ros: starts ROS processes; given by fixture and folder")
    config.addinivalue_line("markers", "docs: runs what the documents show; `make test-docs`")
    config.addinivalue_line("markers", "slow: takes seconds; given by folder, or by the test")
    if not config.pluginmanager.hasplugin("timeout"):  # where `colcon test` runs, perhaps
        config.addinivalue_line("markers", "timeout(seconds): needs pytest-timeout")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark by fixture and by folder; limit every test's time; bring the files into an order.

    The documents' are long and come first. Those with marks lie spread among the others, and short
    ones are left for the end: so the processes of `make test` seldom fly graphs at once, and end
    together.
    """
    for item in items:
        where = item.path.relative_to(TESTS).as_posix()
        for mark in marks(where, getattr(item, "fixturenames", ())):
            item.add_marker(mark)
        if not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(TIMEOUT_S))
    places: dict[Path, float] = {}
    marked = {
        item.path for item in items if {"ros", "slow"} & {m.name for m in item.iter_markers()}
    }
    for is_marked, until in ((True, FLYING_UNTIL), (False, 1.0)):
        files = dict.fromkeys(item.path for item in items if (item.path in marked) == is_marked)
        places |= {path: until * k / len(files) for k, path in enumerate(files)}
    places |= {item.path: -1.0 for item in items if item.path.parent.name == "docs"}
    items.sort(key=lambda item: places[item.path])


def pytest_collection_finish() -> None:
    """Leave what is there now out of the search for garbage, which takes a tenth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


@pytest.fixture(scope="session")
def paper_robot() -> Robot:
    """The satellite with the 6-joint arm of Tables II and III."""
    return Robot.from_yaml(ROBOTS / "paper.yaml")


@pytest.fixture
def space_robot(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a `space-robot` command to its end, in this process."""

    def run(*words: object) -> Ran:
        from space_robot.cli.main import main

        with pytest.raises(SystemExit) as ended:
            main([*map(str, words)])
        out, err = capsys.readouterr()
        return Ran(int(ended.value.code or 0), out, err)

    return run


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A ROS domain of the test's own."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with ros_domain() as number:
        yield number


@pytest.fixture
def udp_port() -> int:
    """A UDP port of this machine that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="session")
def fly(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Flown]:
    """Fly a graph with the given options; each set of options flies once a session."""
    pytest.importorskip("rclpy")
    flown: dict[tuple[str, ...], Flown] = {}

    def run(*options: str) -> Flown:
        if options not in flown:
            bag = tmp_path_factory.mktemp("flights") / "bag"
            result = space_robot_here("fly", *options, "--bag", str(bag), "--json")
            assert result.returncode == 0, result.stderr
            flown[options] = Flown(json.loads(result.stdout), bag, result.stderr)
        return flown[options]

    return run


@pytest.fixture
def free_domain() -> Iterator[int]:
    """Of nobody: a flight will take it. None that looks for a free one does."""
    with ros_domain(namespace=RESERVED) as domain:
        yield domain


@pytest.fixture
def start(domain: int) -> Iterator[Start]:
    """Start nodes in a domain of their own; what still runs at the end is stopped."""
    running: list[Forked] = []

    def run(node: str, **parameters: object) -> Forked:
        arguments = ["--ros-args"] if parameters else []
        for name, value in parameters.items():
            arguments += ["-p", f"{name.replace('__', '.')}:={value}"]
        environment = {**ros_environment(), "ROS_DOMAIN_ID": str(domain)}
        running.append(Forked(MODULES[node], arguments, environment))
        return running[-1]

    yield run
    for process in running:
        process.kill()
        process.communicate(END_S)


@pytest.fixture
def ground(domain: int) -> Iterator[Ground]:
    """A node of the test in the same domain."""
    pytest.importorskip("rclpy")
    from ground import Ground

    it = Ground(domain)
    yield it
    it.close()
