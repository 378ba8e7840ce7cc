"""What is drawn of a robot: derived shapes, meshes of files, and the binary glTF of trimesh."""

from __future__ import annotations

import io
import os
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_pages import Scene

from space_robot.view import mesh, meshes
from space_robot.view.arrows import ArrowSize, arrow_glb
from space_robot.view.local_server import local_server
from space_robot.view.mesh import read_mesh, simplify
from space_robot.view.meshes import read_meshes, shown_shapes
from space_robot.view.scene import RobotScene
from space_robot.view.solids import foil, frame, panel
from space_robot.view.spacecraft import BACK_COLOUR, THICKNESS, panels_of_plates, parts_of
from space_robot_model.robot import Robot
from space_robot_model.robot.shapes import BASE_COLOUR, PANEL_COLOUR
from space_robot_model.robot.tree import Plate, Visual

EDGES = st.tuples(st.floats(0.1, 5.0), st.floats(0.1, 5.0), st.floats(0.1, 5.0))


def box(size: tuple[float, ...], colour: tuple[float, float, float, float] | None) -> Visual:
    return Visual("box", size, np.eye(3), np.zeros(3), colour=colour)


def visual(file: Path | str, body: int = 2, size: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Visual:
    return Visual("mesh", size, np.eye(3), np.zeros(3), str(file), body=body)


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("meshes") / "ball.stl"
    trimesh.creation.icosphere(subdivisions=5, radius=0.5).export(file)
    return file


@settings(max_examples=30)
@given(EDGES)
def test_the_base_has_the_size_of_its_box_and_its_faces_look_outwards(
    size: tuple[float, ...],
) -> None:
    parts = parts_of(box(size, BASE_COLOUR))
    assert [part.name for part in parts] == ["foil", "frame"]
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    np.testing.assert_allclose(np.ptp(vertices, axis=0), size)
    np.testing.assert_allclose(vertices.max(axis=0), 0.5 * np.array(size))
    skin = trimesh.Trimesh(*foil(np.array(size)))
    assert skin.is_watertight
    assert 0.85 * np.prod(size) < skin.volume < np.prod(size)  # positive: outwards
    struts = trimesh.Trimesh(*frame(np.array(size), 0.01), process=False)
    assert all(part.volume > 0.0 for part in struts.split(only_watertight=False))


@settings(max_examples=30)
@given(st.permutations([0.02, 1.2, 1.0]))
def test_solar_cells_are_on_both_large_sides_and_nearly_cover_them(size: list[float]) -> None:
    back, cells = panel(np.array(size))
    drawn = trimesh.Trimesh(*cells, process=False)
    assert trimesh.Trimesh(*back).volume > 0.0
    thin = int(np.argmin(size))
    normals = drawn.face_normals[:, thin]
    np.testing.assert_allclose(np.abs(normals), 1.0)
    np.testing.assert_allclose(drawn.triangles_center[:, thin], 0.01 * np.sign(normals))
    assert 0.75 * 2.4 < drawn.area < 2.4
    assert (np.ptp(cells.vertices, axis=0) <= np.array(size) + 1e-12).all()


@pytest.mark.parametrize(
    "shape",
    [
        box((1.0, 1.0, 1.0), (0.1, 0.2, 0.3, 1.0)),
        box((1.0, 1.0, 1.0), None),
        Visual("sphere", (1.0,), np.eye(3), np.zeros(3), colour=BASE_COLOUR),
        box((1.0, 1.0, 1.0), PANEL_COLOUR),  # on a spring, and not flat
    ],
)
def test_what_a_file_draws_is_left_alone(shape: Visual) -> None:
    assert parts_of(shape) == []


def test_plates_beside_the_base_are_panels_of_their_area(paper_robot: Robot) -> None:
    up, aside = np.array([0.0, 0.0, 1.0]), np.array([0.0, 2.0, 0.0])
    plates = (
        Plate(4.0, up, aside),
        Plate(4.0, -up, aside),  # its other side
        Plate(1.0, up, np.array([0.0, 0.0, 0.63])),  # a face of the base
        Plate(2.0, np.array([0.6, 0.0, 0.8]), -aside, specular=0.7),
    )
    shapes = shown_shapes(replace(paper_robot, plates=plates)).shapes
    first, second = shapes[len(shown_shapes(paper_robot).shapes) :]
    assert first.size == pytest.approx((2.0, 2.0, THICKNESS))
    assert second.size == pytest.approx((np.sqrt(2.0), np.sqrt(2.0), THICKNESS))
    np.testing.assert_allclose(second.rotation[:, 2], [0.6, 0.0, 0.8])
    assert (first.colour, second.colour) == (PANEL_COLOUR, BACK_COLOUR)
    assert list(panels_of_plates(paper_robot, shapes)) == []


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
    broken, lacking = tmp_path / "broken.stl", "package://lacking/arm.stl"
    broken.write_text("solid nothing\nendsolid nothing\n")
    told = (visual(ball, 1), visual(broken, 1), visual(lacking, 3))
    found = shown_shapes(replace(paper_robot, visuals=told))
    assert found.shapes[0] == told[0]
    assert {shape.body for shape in found.shapes[1:]} == {3}
    assert all(shape.shape == "cylinder" for shape in found.shapes[1:])
    for remark, file in zip(found.remarks[-2:], (broken, lacking), strict=True):
        assert remark.startswith(f"mesh {file}: cannot be drawn (")
        assert "\n" not in remark


def test_files_that_are_too_large_or_none_are_told_and_the_others_share_the_faces(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("archive.zip", "pipe.stl", "lacking.stl", "empty.stl", "broken.glb")
    archive, pipe, lacking, empty, broken = (tmp_path / name for name in names)
    with zipfile.ZipFile(archive, "w") as written:
        written.write(ball, "ball.stl")
    content = bytearray(archive.read_bytes())
    at = content.rindex(b"PK\x01\x02") + 24  # the size in the directory
    content[at : at + 4] = (3 * 10**9).to_bytes(4, "little")
    archive.write_bytes(content)
    os.mkfifo(pipe)
    empty.write_text("solid nothing\nendsolid nothing\n")
    broken.write_bytes(b"glTF" + bytes(30))
    files = tuple(map(str, (archive, pipe, lacking, empty, broken, ball)))
    *unreadable, read = read_meshes(files, 6 * 2_000)
    reasons = ["has 3e+03 MB, at most 500 MB are allowed", "not a file", "no such file"]
    assert [result.reason for result in unreadable[:3]] == reasons
    assert all(result.reason and result.mesh is None for result in unreadable)
    assert read.mesh is not None
    assert read.whole == 20_480
    assert 500 < len(read.mesh.faces) <= 2_000  # its share
    for name, limit, why in (
        ("MOST_READ", 20_479, r"^20480 faces, at most 20479 are allowed$"),
        ("MOST_READ", 10_000, r"^10242 vertices, "),
        ("MOST_BYTES", 1000, "at most 0.001 MB are allowed"),
    ):
        monkeypatch.setattr(mesh, name, limit)
        with pytest.raises(mesh.UnreadableMeshError, match=why):
            read_mesh(str(ball))


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


def test_an_arrow_is_closed_and_has_its_length() -> None:
    data = arrow_glb(ArrowSize(2.0, 3.0), (230, 159, 0))
    (read,) = trimesh.load(io.BytesIO(data), "glb").geometry.values()
    read.merge_vertices(merge_norm=True, merge_tex=True)
    read.update_faces(read.nondegenerate_faces())
    assert read.is_watertight
    assert read.volume > 0.0  # its faces look outwards
    np.testing.assert_allclose(read.bounds[:, 2], [0.0, 2.0], atol=1e-6)
