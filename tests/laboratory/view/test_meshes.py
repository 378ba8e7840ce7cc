"""Meshes: read, made small, and what is drawn where one cannot be read."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scene_pages import Scene

from space_robot.view import mesh_process, meshes
from space_robot.view.local_server import local_server
from space_robot.view.mesh import simplify
from space_robot.view.mesh_process import MOST_BYTES, TOO_MUCH, UnreadableMeshError, read_mesh
from space_robot.view.meshes import read_meshes, shown_shapes
from space_robot.view.scene import RobotScene
from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Visual


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
    assert simplify(whole, 20_480) is whole
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
        f"mesh {broken}",
        f"mesh {lacking}",
    ]
    assert all("\n" not in remark for remark in found.remarks)


def gltf_of(count: int) -> bytes:
    """A mesh of so many vertices that are not stored: all are zero."""
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "bufferViews": [],
        "accessors": [
            {"componentType": 5126, "count": count, "type": "VEC3"},
            {"componentType": 5125, "count": count, "type": "SCALAR"},
        ],
    }
    return json.dumps(content).encode()


def test_what_unpacks_to_too_much_is_refused_and_what_follows_is_read(
    ball: Path, tmp_path: Path
) -> None:
    """An archive by what it states, memory by what is used; a pipe is never read."""
    archive, pipe = tmp_path / "archive.zip", tmp_path / "pipe.stl"
    with zipfile.ZipFile(archive, "w") as written:
        written.write(ball, "ball.stl")
    content = bytearray(archive.read_bytes())
    at = content.rindex(b"PK\x01\x02") + 24  # the size in the directory
    content[at : at + 4] = (MOST_BYTES + 10**9).to_bytes(4, "little")
    archive.write_bytes(content)
    os.mkfifo(pipe)
    zeros = tmp_path / "zeros.gltf"
    zeros.write_bytes(gltf_of(MOST_BYTES // 12 + 1))
    files = [archive, pipe, zeros, ball, tmp_path / "lacking.stl"]
    read = read_meshes(tuple(map(str, files)), 5 * 2_000)
    assert [result.mesh is not None for result in read] == [file == ball for file in files]
    assert read[3].whole == 20_480
    assert read[3].mesh is not None
    assert 500 < len(read[3].mesh.faces) <= 2_000  # its share
    assert read[0].reason == "unpacks to 3 GB, at most 2 GB are allowed"
    assert [r.reason for r in read[1:3] + read[4:]] == ["not a file", TOO_MUCH, "no such file"]


def test_more_vertices_or_faces_than_allowed(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_process, "MOST_READ", 20_480)
    assert len(read_mesh(str(ball)).faces) == 20_480
    monkeypatch.setattr(mesh_process, "MOST_READ", 20_479)
    with pytest.raises(UnreadableMeshError, match=r"^20480 faces, at most 20479 are allowed$"):
        read_mesh(str(ball))
    monkeypatch.setattr(mesh_process, "MOST_READ", 10_000)
    with pytest.raises(UnreadableMeshError, match=r"^10242 vertices, "):
        read_mesh(str(ball))


def test_a_file_whose_reader_is_killed_is_refused_and_what_follows_is_read(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a limit of its time: a library that loops does not come back to tell."""
    killer = tmp_path / "trimesh"
    killer.mkdir()
    (killer / "__init__.py").write_text(
        "import os, signal\ndef load_mesh(file):\n    if 'evil' in file:\n"
        "        os.kill(os.getpid(), signal.SIGXCPU)\n    raise ValueError('of the stand-in')\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    for name in ("evil.stl", "evil2.stl"):
        shutil.copy(ball, tmp_path / name)
    files = [str(tmp_path / "evil.stl"), str(ball), str(tmp_path / "evil2.stl")]
    assert [r.reason for r in read_meshes(tuple(files), 9)] == [
        TOO_MUCH,
        "of the stand-in",
        TOO_MUCH,
    ]


def test_a_mesh_is_drawn_in_its_size_and_a_mirrored_one_looks_outwards(
    paper_robot: Robot, tmp_path: Path
) -> None:
    file = tmp_path / "box.obj"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(file)
    told = (visual(file, 0, (0.1, 0.1, 0.1)), visual(file, 0, (-0.1, 0.1, 0.1)))
    with local_server() as server:
        scene = RobotScene(server.scene, "/robot", replace(paper_robot, visuals=told))
        page = server.get_scene_serializer().as_html()
    assert scene.base.name == "/robot/base_link"
    found = Scene(page)
    for name in ("/robot/base_link/shape_0", "/robot/base_link/shape_1"):
        vertices, faces = found.mesh(name)
        shown = trimesh.Trimesh(vertices, faces, process=False)
        np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.1, 0.2, 0.3], rtol=1e-6)
        assert shown.volume == pytest.approx(0.006, rel=1e-5)
