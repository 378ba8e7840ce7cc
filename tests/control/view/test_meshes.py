"""Meshes: read, made small, and what is drawn where one cannot be read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scene_pages import Scene

from space_robot_control.view import meshes
from space_robot_control.view.meshes import read_mesh, shown_shapes, simpler
from space_robot_control.view.scene import RobotScene
from space_robot_control.view.stage import silent_server
from space_robot_sim.robot import Robot
from space_robot_sim.robot.tree import Visual


def visual(mesh: Path | str, body: int = 2, size: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Visual:
    return Visual("mesh", size, np.eye(3), np.zeros(3), str(mesh), body=body)


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("meshes") / "ball.stl"
    trimesh.creation.icosphere(subdivisions=5, radius=0.5).export(file)
    return file


def test_a_large_mesh_keeps_its_form_with_fewer_faces(
    ball: Path, paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read_mesh(str(ball))
    assert len(whole.faces) == 20_480
    assert simpler(whole, 20_480) is whole
    monkeypatch.setattr(meshes, "MOST_FACES", 2_000)
    found = shown_shapes(replace(paper_robot, visuals=(visual(ball),)))
    small = found.meshes[str(ball)]
    assert 500 < len(small.faces) <= 2_000
    radii = np.linalg.norm(small.vertices, axis=1)
    assert radii.min() > 0.45
    assert radii.max() < 0.505
    shown = trimesh.Trimesh(small.vertices, small.faces)
    assert shown.volume == pytest.approx(np.pi / 6.0, rel=0.05)  # and the faces look outwards
    assert found.remarks == (
        f"{ball}: drawn with {len(small.faces)} of its 20480 faces, to keep the page small",
    )


def test_a_body_whose_meshes_cannot_be_read_is_drawn_from_its_numbers(
    ball: Path, paper_robot: Robot, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.stl"
    broken.write_text("solid nothing\nendsolid nothing\n")
    lacking = "package://lacking/arm.stl"
    told = (visual(ball, 1), visual(broken, 1), visual(lacking, 3))
    found = shown_shapes(replace(paper_robot, visuals=told))
    assert found.shapes[0] == told[0]
    assert {shape.body for shape in found.shapes[1:]} == {3}
    assert all(shape.shape == "cylinder" for shape in found.shapes[1:])
    assert [remark.split(": cannot be drawn")[0] for remark in found.remarks[-2:]] == [
        f"mesh {broken}", f"mesh {lacking}",
    ]  # fmt: skip
    assert all("\n" not in remark for remark in found.remarks)


def test_a_mesh_is_drawn_in_its_size_and_a_mirrored_one_looks_outwards(
    paper_robot: Robot, tmp_path: Path
) -> None:
    file = tmp_path / "box.obj"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(file)
    told = (visual(file, 0, (0.1, 0.1, 0.1)), visual(file, 0, (-0.1, 0.1, 0.1)))
    with silent_server() as server:
        scene = RobotScene(server.scene, "/robot", replace(paper_robot, visuals=told))
        page = server.get_scene_serializer().as_html()
    assert scene.base.name == "/robot/base_link"
    found = Scene(page)
    for name in ("/robot/base_link/shape_0", "/robot/base_link/shape_1"):
        vertices, faces = found.mesh(name)
        shown = trimesh.Trimesh(vertices, faces, process=False)
        np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.1, 0.2, 0.3], rtol=1e-6)
        assert shown.volume == pytest.approx(0.006, rel=1e-5)
