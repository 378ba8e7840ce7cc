"""What pip, colcon and rosdep are told: one list, and executables that find their interpreter."""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from command import run_program
from import_graph import PACKAGES, modules
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from space_robot.cli.main import COMMANDS
from space_robot.processes import MODULES
from space_robot_msgs_py import topics

ROOT = Path(__file__).resolve().parents[1]
EXECUTABLES = sorted((ROOT / "resource/executables").iterdir())
PYPI = {"yaml": "pyyaml", "typing_extensions": "typing-extensions", "pinocchio": "pin"}
PYPI |= {"cuda": "cuda-bindings", "yamcs": "yamcs-pymdb"}
PYPI |= {"space_packet_parser": "space-packet-parser"}
PYPI |= {"sklearn": "scikit-learn", "threadpoolctl": "scikit-learn"}  # which brings it
"""Names on PyPI of modules that are not called as their package."""
OF_EXTRAS = {
    "aiohttp": "ground",
    "cuda-bindings": "gpu",
    "distributed": "dask",
    "gymnasium": "gym",
    "lxml": "ground",
    "pandas": "campaign",
    "pyarrow": "parquet",
    "space-packet-parser": "ground",
    "spacepackets": "ground",
    "trimesh": "view",
    "viser": "view",
    "xacro": "xacro",
    "yamcs-pymdb": "ground",
}
"""Packages that one command needs, and their extra."""
ROSDEP = {"pyyaml": "yaml", "rosbags": "rosbags-pip", "scikit-learn": "sklearn"}
"""Names of rosdep's keys, behind python3-, where they are not the package's."""


def setup_keyword(name: str) -> Any:
    """A literal that setup.py hands to setuptools."""
    tree = ast.parse((ROOT / "setup.py").read_text("utf-8"))
    (call,) = (
        n
        for n in ast.walk(tree)
        if isinstance(n, ast.Call)
        and n.keywords
        and isinstance(n.func, ast.Name)
        and n.func.id == "setup"
    )
    return ast.literal_eval(next(k.value for k in call.keywords if k.arg == name))


def packages(requirements: list[str]) -> set[str]:
    """Names of packages, as pip compares them."""
    return {re.split(r"[^\w.-]", text)[0].lower().replace("_", "-") for text in requirements}


def dependencies(kind: str) -> set[str]:
    """What package.xml lists."""
    tree = ElementTree.parse(ROOT / "package.xml")
    return {item.text or "" for item in tree.iter(kind)}


def from_pip() -> set[str]:
    """Packages that the comment in package.xml leaves to pip."""
    text = (ROOT / "package.xml").read_text("utf-8")
    match = re.search(r"<!-- From pip.*?:\s(.*?)\. -->", text, re.DOTALL)
    assert match is not None
    return set(match.group(1).replace(",", " ").split())


def test_the_version_is_that_of_the_changelog_everywhere() -> None:
    """Its newest entry, which has its date or none; setup.py reads it, two files repeat it."""
    heads = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    entries = [re.fullmatch(r"(\d+\.\d+\.\d+) \((unreleased|\d{4}-\d\d-\d\d)\)", h) for h in heads]
    assert all(entries), heads
    found = [entry.groups() for entry in entries if entry]
    version = found[0][0]
    assert dependencies("version") == {version}
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {version}\n" in citation
    assert f"version = {{{version}}}," in (ROOT / "README.md").read_text("utf-8")
    named = [sys.executable, "setup.py", "--version"]
    said = subprocess.run(named, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[-1] == version
    assert all(date != "unreleased" for _, date in found[1:])
    dates = re.findall(r"^date-released: (\S+)$", citation, re.MULTILINE)
    assert dates == [found[0][1]] * (found[0][1] != "unreleased")
    assert found == sorted(found, key=lambda e: [int(n) for n in e[0].split(".")], reverse=True)


def test_setup_py_and_the_imports_name_the_same_packages() -> None:
    """What is imported is required, or of an extra and looked for before; nothing else is."""
    found = third_party_imports()
    required = packages(setup_keyword("install_requires"))
    assert found - set(OF_EXTRAS) - dependencies("exec_depend") == required
    extras = setup_keyword("extras_require")
    for name, extra in OF_EXTRAS.items():
        assert name in found
        assert name in packages(extras[extra])
        assert name in packages(extras["test"])


def third_party_imports() -> set[str]:
    """Packages that the five packages import anywhere, by their names on PyPI."""
    return imports_of(ROOT / file for file in modules().values())


def imports_of(files: Iterable[Path]) -> set[str]:
    """Packages of others that some files import, by their names on PyPI."""
    names = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                names.add(node.module.split(".")[0])
    names -= {*sys.stdlib_module_names, *PACKAGES}
    return {PYPI.get(name, name) for name in names}


def test_the_docs_name_every_extra_that_a_command_needs() -> None:
    """By the line that its error shows; and no extra that is not there."""
    extras = setup_keyword("extras_require")
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    text = "\n".join(page.read_text("utf-8") for page in pages)
    for extra in OF_EXTRAS.values():
        assert shlex.join(["pip", "install", *extras[extra]]) in text, extra
    named = {
        name
        for group in re.findall(r"install [^\n]*\[([\w,]+)\]", text)
        for name in group.split(",")
    }
    assert named <= set(extras)


def test_the_makefile_installs_extras_of_setup_py_and_tests_alone_are_a_recipe() -> None:
    """A new release of a checker of types or style must not stop a new user's tests."""
    text = (ROOT / "Makefile").read_text("utf-8")
    named = {name for group in re.findall(r"'\.\[([\w,]+)\]'", text) for name in group.split(",")}
    assert {"ros", "test", "mutation"} <= named <= set(setup_keyword("extras_require"))
    recipes = dict(re.findall(r"^(\w+):([^\n]*\n(?:\t.*\n)*)", text, re.MULTILINE))
    assert "lint" not in recipes["test"]
    assert "lint" in recipes["check"]
    assert all("$(PYTEST) $(CHOSEN)" in recipes[name] for name in ("check", "test"))


def test_every_requirement_has_its_known_version_for_each_python() -> None:
    """By the markers of the lines: exactly one holds, and it is a version that setup.py admits."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pinned = [Requirement(line) for line in lines if line[0] not in " #"]
    extras: dict[str, list[str]] = setup_keyword("extras_require")
    left_out = {"apt", "bench"}
    required = [*setup_keyword("install_requires"), "pip", "setuptools"]
    required += [text for extra in extras.keys() - left_out for text in extras[extra]]
    for python in ("3.10", "3.11", "3.12", "3.13"):
        versions = {"python_version": python, "python_full_version": f"{python}.0"}
        here = {
            canonicalize_name(pin.name): next(iter(pin.specifier)).version
            for pin in pinned
            if pin.marker is None or pin.marker.evaluate(versions)
        }
        for text in required:
            wanted = Requirement(text)
            if wanted.marker and not wanted.marker.evaluate(versions):
                continue
            assert wanted.specifier.contains(here[canonicalize_name(wanted.name)]), (python, text)


def test_package_xml_has_what_setup_py_requires() -> None:
    """By its rosdep key, or in the comment on those that have none."""
    from_rosdep = {name for name in dependencies("exec_depend") if name.startswith("python3-")}
    required = packages(setup_keyword("install_requires"))
    left_to_rosdep = {f"python3-{ROSDEP.get(name, name)}" for name in required - from_pip()}
    assert from_pip() <= required
    assert from_rosdep == left_to_rosdep


def test_package_xml_has_the_packages_of_all_messages() -> None:
    """Also of those that are sent only where their package is installed."""
    ros = dependencies("exec_depend")
    sent = {value for value in vars(topics).values() if isinstance(value, topics.Topic)}
    assert {topic.type.split("/")[0] for topic in sent} <= ros
    wheels = packages(setup_keyword("extras_require")["ros"])
    assert "rclpy" in ros
    assert "ros-jazzy-rclpy" in wheels


def test_package_xml_has_what_launch_files_import_and_tests_need() -> None:
    assert imports_of((ROOT / "launch").glob("*.py")) <= dependencies("exec_depend")
    tested = packages(setup_keyword("extras_require")["test"])
    assert {name.removeprefix("python3-") for name in dependencies("test_depend")} <= tested


def test_there_is_one_executable_for_each_command_and_node() -> None:
    names = {path.name for path in EXECUTABLES}
    assert names == {*COMMANDS, *(f"{node}_node" for node in MODULES)}
    assert len({path.read_text("utf-8") for path in EXECUTABLES}) == 1
    assert all(os.access(path, os.X_OK) for path in EXECUTABLES)


DESCRIBE = """
from distutils.core import run_setup
it = run_setup("setup.py", stop_after="config")
print(it.get_version(), sorted(it.packages), it.data_files)
"""


def test_setup_py_describes_the_package_from_any_folder(tmp_path: Path) -> None:
    """`colcon build --symlink-install` runs a link to it in a folder of its own."""
    pytest.importorskip("setuptools")
    (tmp_path / "setup.py").symlink_to(ROOT / "setup.py")
    command = [sys.executable, "-c", f"import setuptools\n{DESCRIBE}"]
    here, there = (run_program(command, cwd=folder) for folder in (ROOT, tmp_path))
    assert there.stdout == here.stdout, there.stderr[-500:]
    assert "space_robot_sim.plant" in here.stdout
    assert "'config/cases/1.yaml'" in here.stdout
