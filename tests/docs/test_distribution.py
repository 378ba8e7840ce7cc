"""`make fly`, and the wheel of `make dist` away from any clone: its commands work from any folder.

The environment has the wheel alone; what it requires comes from the environment of the tests, and
kernels from their cache, for to compile them takes minutes. `CONTRIBUTING.md` has the check by hand
in an environment that takes everything from the registry.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

import pytest
from command import run_program
from conftest import TOOLS
from flights import ros_environment
from import_graph import PACKAGES
from pages import files
from paths import DOCS, ROOT

from space_robot_msgs_py import topics
from space_robot_msgs_py.compiled.cache import cache_directory

pytestmark = pytest.mark.docs
pytest.importorskip("build")
caching = pytest.importorskip("numba.core.caching")

OF_THE_PROJECT = (
    *("config", "examples", "launch", "resource", *PACKAGES),
    *("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "MANIFEST.in", "README.md"),
    *("constraints.txt", "package.xml", "pyproject.toml", "setup.py", "docs/explanation/errata.md"),
)
"""What a distribution is made of; the tests' copy has nothing else."""
MADE = shutil.ignore_patterns("__pycache__")
EXPORTED = ROOT / "examples/flight_computer/flight_code"
"""Made by its Makefile."""
VERSION = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)[0]


class Environment(NamedTuple):
    """A virtual environment with the wheel, and an empty folder to work in."""

    folder: Path
    work: Path

    def run(self, *words: str, code: int = 0) -> str:
        """Run a command of the environment; return its output and messages."""
        command = [str(self.folder / "bin" / words[0]), *words[1:]]
        environment = {k: v for k, v in os.environ.items() if k not in LEFT_OUT}
        environment["NUMBA_CACHE_DIR"] = str(self.folder / "kernels")
        environment["PATH"] = f"{self.folder / 'bin'}{os.pathsep}{environment['PATH']}"
        done = subprocess.run(
            command,
            cwd=self.work,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=500,
            check=False,
        )
        assert done.returncode == code, f"{' '.join(words)}:\n{done.stdout[-3000:]}"
        return done.stdout


LEFT_OUT = {"PYTHONPATH", "PYTHONHOME", "ROS_DOMAIN_ID", "COVERAGE_PROCESS_CONFIG"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as `make dist` does: the source distribution, and the wheel from it."""
    source = tmp_path_factory.mktemp("source")
    for name in OF_THE_PROJECT:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name, ignore=MADE)
        else:
            shutil.copy2(ROOT / name, source / name)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(source / "dist")]
    done = run_program(command, cwd=source)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    (built,) = (source / "dist").glob("*.whl")
    return built


def test_the_wheel_has_every_file_that_is_read(wheel: Path) -> None:
    """All of the packages, the configuration, the examples and the launch files, unchanged."""
    assert wheel.name == f"space_robot-{VERSION}-py3-none-any.whl"
    assert wheel.with_name(f"space_robot-{VERSION}.tar.gz").is_file()
    share = f"space_robot-{VERSION}.data/data/share/space_robot"
    places = {name: f"{share}/{name}" for name in ("config", "examples", "launch")}
    places |= {name: name for name in PACKAGES}
    with ZipFile(wheel) as archive:
        inside = {name: archive.getinfo(name) for name in archive.namelist()}
        for folder, place in places.items():
            for file in sorted((ROOT / folder).rglob("*.*")):
                if file.is_dir() or "__pycache__" in file.parts or file.is_relative_to(EXPORTED):
                    continue
                name = f"{place}/{file.relative_to(ROOT / folder)}"
                assert name in inside, name
                assert archive.read(name) == file.read_bytes(), name
        assert f"{share}/docs/explanation/errata.md" in inside


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    folder, work = tmp_path_factory.mktemp("environment"), tmp_path_factory.mktemp("work")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "bin/python"), "install", "-q"]
    options = ["--no-deps", "--no-index", "--no-compile", "--disable-pip-version-check"]
    subprocess.run([*pip, *options, str(wheel)], check=True, capture_output=True)
    (site,) = folder.glob("lib/python*/site-packages")
    # the path alone: the editable installation of the clone is behind a .pth file there
    (site / "tests.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    environment = Environment(folder, work)
    _take_kernels(environment, site)
    return environment


def _take_kernels(environment: Environment, site: Path) -> None:
    """Copy the compiled kernels, under the names that they have for the installed sources.

    Numba names a cache by the folder of the source, and finds it outdated if the source has another
    time of change.
    """
    show = "from space_robot_msgs_py.compiled import cache; print(cache.cache_directory())"
    theirs, ours = Path(environment.run("python", "-c", show).strip()), cache_directory()
    theirs.mkdir(parents=True, exist_ok=True)
    subpath = caching.UserProvidedCacheLocator.get_suitable_cache_subpath
    for package in PACKAGES:
        for source in sorted((ROOT / package).rglob("*.py")):
            target = site / source.relative_to(ROOT)
            shutil.copystat(source, target)
            kernels = theirs / subpath(str(target))
            if (ours / subpath(str(source))).is_dir() and not kernels.exists():
                shutil.copytree(ours / subpath(str(source)), kernels)
    for mark in ours.iterdir():  # says which kernels are complete
        if mark.is_file():
            shutil.copy(mark, theirs)


def test_packages_and_their_version_are_those_of_the_wheel(installed: Environment) -> None:
    show = f"import {', '.join(PACKAGES)}; print(*(p.__file__ for p in ({', '.join(PACKAGES)})))"
    for file in installed.run("python", "-c", show).split():
        assert Path(file).is_relative_to(installed.folder), file
    assert installed.run("space-robot", "--version") == f"space-robot, version {VERSION}\n"
    show = "import space_robot; print(space_robot.__version__)"
    assert installed.run("python", "-c", show) == f"{VERSION}\n"


def test_a_flight_its_view_and_its_analysis(installed: Environment) -> None:
    flight = ("--controller", "ctc", "--case", "3", "--duration", "0.1")
    installed.run("space-robot", "simulate", *flight, "--bag", "flights/one")
    assert "attitude" in installed.run("space-robot", "analyze", "flights/one")
    pytest.importorskip("viser")
    installed.run("space-robot", "view", "flights/one", "--no-open", "--out", "one.html")
    assert (installed.work / "one.html").stat().st_size > 100_000


def test_a_graph_of_nodes(installed: Environment) -> None:
    """And executables where `ros2 run` looks for them, of which one reads the rest of its line."""
    for name in ("fly", "simulate", "plant_node"):
        assert os.access(installed.folder / "lib/space_robot" / name, os.X_OK)
    pytest.importorskip("rclpy")
    said = installed.run("space-robot", "fly", "--duration", "0.1", "--bag", "flights/graph")
    assert "messages lost: none" in said
    node = "../lib/space_robot/mission_node"
    said = installed.run(node, "--ros-args", "-p", "no_such:=1", code=2)
    assert "mission_node: error: " in said
    assert "'no_such'" in said


def test_examples_robots_scenarios_and_campaigns(installed: Environment) -> None:
    installed.run("space-robot", "examples", "copy", "copies")
    flight = ("simulate", "--duration", "0.01")
    installed.run("space-robot", *flight, "--robot", "copies/config/robots/seven_joint.yaml")
    assert "kg" in installed.run("space-robot", "robot", "copies/examples/two_link_arm.urdf")
    content = files(DOCS / "manual/configuration.md")
    (installed.work / "plan.yaml").write_text(content["plan.yaml"])
    assert "controller" in installed.run("space-robot", "scenario", "--scenario", "plan.yaml")
    pytest.importorskip("pyarrow")
    words = ("campaign", "run", "first", "--runs", "1", "--workers", "0", "--out", "campaigns/a")
    assert "1 runs" in installed.run("space-robot", *words)


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_fly_flies_and_prints_the_table(free_domain: int, tmp_path: Path) -> None:
    """In the tests' own environment: that of a new clone is set up before the tests run."""
    pytest.importorskip("rclpy")
    options = f"--duration 0.2 --domain {free_domain} --bag {tmp_path / 'bag'}"
    command = ["make", "-o", f"{sys.prefix}/.flies", "fly", f"VENV={sys.prefix}", f"ARGS={options}"]
    made = run_program(command, cwd=ROOT, env=ros_environment())
    assert made.returncode == 0, made.stderr
    assert "tde_stc, case 1, gains default: 400 ticks, 0.2 s" in made.stdout
    assert "messages lost: none" in made.stdout


HIDE = """
import importlib.machinery as machinery
find = machinery.PathFinder.find_spec
def hide(name, path=None, target=None):
    return None if name in {names!r} else find(name, path, target)
machinery.PathFinder.find_spec = hide
"""


def test_all_modules_are_collected_without_ros_and_the_tools_of_tests(tmp_path: Path) -> None:
    """Where only pytest and what the package requires are installed, as for `colcon test`."""
    ros = ("rclpy", *sorted({topic.type.split("/")[0] for topic in topics.ALL}))
    (tmp_path / "hide.py").write_text(HIDE.format(names=(*TOOLS, *ros)))
    command = "-m pytest -p hide -p no:cacheprovider --collect-only -rs"
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
    }
    done = run_program([sys.executable, *command.split()], cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stdout[-2000:]
    skipped = done.stdout.partition("short test summary")[2]
    assert "hypothesis is not installed" in skipped
    assert "could not import 'rclpy'" in skipped
