"""The house as CONTRIBUTING.md describes it: imports lead downwards, and nothing in circles."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from import_graph import PACKAGES, Graph, circle, folders, imports, modules, strings
from paths import ROOT, TESTS

from space_robot.scenario.faults import KINDS

ROOMS = {
    "space_robot_msgs_py": "errors simulated_time topics compiled signals samples config wire bag "
    "telemetry ros recorder_node",
    "space_robot_model": "elementary dynamics robot hardware orbit",
    "space_robot_sim": "faults component environment actuators sensors plant plant_node",
    "space_robot_control": "laws navigation allocation controller flight_code controller_node "
    "guidance mission_node",
    "space_robot": "console processes scenario tuning flight gpu export analysis view ground api "
    "learning campaign trace choice paper doctor help cli __main__",
}
"""Of each package, from the ground up: a room imports only from rooms that stand before it."""
VAGUE = {"found", "given", "told"}
UPPER = re.compile(r"space_robot_(sim|control|model)\b|\b(plant|controller|mission)_node\b")


def place(module: str) -> tuple[int, int]:
    """How high a module stands: its package, its room; a package's ``__init__`` above its rooms."""
    package, _, rest = module.partition(".")
    rooms = ROOMS[package].split()
    room = rest.split(".")[0]
    return PACKAGES.index(package), rooms.index(room) if room else len(rooms)


def rule(importer: str, imported: str) -> str:
    """The rule that an import breaks; empty if none."""
    above, below = place(importer), place(imported)
    pair = {importer.split(".")[0], imported.split(".")[0]}
    if pair == {"space_robot_sim", "space_robot_control"}:
        return "packages: the simulation and the flight software know nothing of one another"
    if below[0] > above[0]:
        return f"packages import only {' <- '.join(PACKAGES)}"
    if below[0] == above[0] and below[1] > above[1]:
        return f"a room imports only from rooms before it: {ROOMS[importer.split('.')[0]]}"
    return ""


@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_is_in_a_room(package: str) -> None:
    names = {name.split(".")[1] for name in modules() if name.startswith(f"{package}.")}
    assert names == set(ROOMS[package].split()), f"{package}: not the rooms of the house"


def test_imports_lead_downwards() -> None:
    broken = [
        f"{modules()[importer]} imports {modules()[imported]}: {why}"
        for importer, found in imports().items()
        for imported in sorted(found)
        if (why := rule(importer, imported))
    ]
    assert not broken, "\n" + "\n".join(broken)


@pytest.mark.parametrize("of_places", [dict, folders], ids=["files", "folders"])
def test_none_import_one_another_in_circles(of_places: Callable[[Graph], Graph]) -> None:
    graph = of_places(imports())
    assert not circle(graph), " -> ".join(circle(graph))


def test_the_ground_floor_names_no_upper_one_and_no_kind_of_fault() -> None:
    """But for topics.py, which says who sends and who hears what."""
    broken = [
        f"{file}:{line} has {text!r}: {PACKAGES[0]} names no other package, node above it or fault"
        for name, file in modules().items()
        if name.startswith(PACKAGES[0])
        for line, text in strings(file)
        if text in KINDS or (name != f"{PACKAGES[0]}.topics" and UPPER.search(text))
    ]
    assert not broken, "\n" + "\n".join(broken)


def test_the_rules_notice_what_they_forbid() -> None:
    assert "packages" in rule("space_robot_sim.plant.loop", "space_robot_control.laws.ctc")
    assert "packages" in rule("space_robot_control.laws.ctc", "space_robot_sim.plant.loop")
    assert "packages" in rule("space_robot_model.dynamics.aba", "space_robot_sim.plant.plant")
    assert "room" in rule("space_robot_model.dynamics.aba", "space_robot_model.robot")
    assert "room" in rule("space_robot_model.robot.robot", "space_robot_model")
    assert not rule("space_robot_sim.plant.plant", "space_robot_model.dynamics.aba")
    assert {*circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})} == {"a", "b", "c"}
    found = [text for _, text in strings(Path(__file__))]
    assert "space_robot_sim" in found
    assert __doc__ not in found


def test_no_class_name_stands_for_two_things() -> None:
    """But for those that every law has."""
    places: dict[str, list[Path]] = {}
    for file in modules().values():
        for node in ast.walk(ast.parse((ROOT / file).read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(file)
    twice = {name: files for name, files in places.items() if len(files) > 1}
    assert set(twice) <= {"Gains", "Memory"}, twice


def test_no_variable_is_called_found_given_or_told() -> None:
    """Such a name says where its value is from; it should say what it is."""
    broken = [
        f"{file}:{node.lineno}"
        for file in modules().values()
        for node in ast.walk(ast.parse((ROOT / file).read_text("utf-8")))
        if (isinstance(node, ast.arg) and node.arg in VAGUE)
        or (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in VAGUE)
    ]
    assert not broken, broken


def test_no_two_test_modules_have_one_name() -> None:
    """Tests are no packages: pytest collects only one of two modules with the same name."""
    names = [file.name for file in TESTS.rglob("test_*.py")]
    assert len(set(names)) == len(names), sorted({name for name in names if names.count(name) > 1})
