"""Mesh files are found where ROS and downloads have them."""

from __future__ import annotations

from pathlib import Path

import pytest
from paths import DATA

from space_robot_model.robot import Robot
from space_robot_model.robot.urdf.visuals import mesh_path


@pytest.fixture
def urdf_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a URDF and a mesh, another one beside it; nothing is installed."""
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    for file in ("arm/urdf/arm.urdf", "arm/meshes/fore.stl", "hand/meshes/palm.stl"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    return tmp_path / "arm" / "urdf"


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("../meshes/fore.stl", "arm/urdf/../meshes/fore.stl"),
        ("nowhere.stl", "arm/urdf/nowhere.stl"),
        ("package://arm/meshes/fore.stl", "arm/meshes/fore.stl"),
        ("model://arm/meshes/fore.stl", "arm/meshes/fore.stl"),
        ("package://hand/meshes/palm.stl", "hand/meshes/palm.stl"),
    ],
)
def test_where_a_mesh_is(name: str, found: str, urdf_folder: Path, tmp_path: Path) -> None:
    assert mesh_path(name, urdf_folder) == str(tmp_path / found)


@pytest.mark.parametrize(
    "name",
    [
        "package://leg/x.stl",
        "package://arm/x.stl",
        "package://",
        "http://x/y.stl",
        "package://arm/a\0b",
    ],
)
def test_what_nobody_knows_keeps_its_name(name: str, urdf_folder: Path) -> None:
    assert mesh_path(name, urdf_folder) == name


def test_a_file_has_its_path(urdf_folder: Path) -> None:
    assert mesh_path("file:///a/b%20c.stl", urdf_folder) == "/a/b c.stl"
    assert mesh_path("/a/b.stl", urdf_folder) == "/a/b.stl"


@pytest.mark.parametrize(
    ("variable", "place"), [("AMENT_PREFIX_PATH", "share/leg"), ("ROS_PACKAGE_PATH", "leg")]
)
def test_installed_packages(
    variable: str, place: str, tmp_path: Path, urdf_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = tmp_path / "installed" / place / "foot.stl"
    mesh.parent.mkdir(parents=True)
    mesh.touch()
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path / 'installed'}")
    assert mesh_path("package://leg/foot.stl", urdf_folder) == str(mesh)


def test_of_a_robot(urdf_folder: Path, tmp_path: Path) -> None:
    text = (DATA / "arm.urdf").read_text().replace("arm/fore.stl", "arm/meshes/fore.stl")
    (urdf_folder / "arm.urdf").write_text(text)
    robot = Robot.from_urdf(urdf_folder / "arm.urdf")
    mesh = next(visual for visual in robot.visuals if visual.shape == "mesh")
    assert mesh.mesh == str(tmp_path / "arm/meshes/fore.stl")
