"""Binary glTF as trimesh reads it: what was written, and all in the right direction."""

from __future__ import annotations

import io

import numpy as np
import pytest
from glb_content import GlbContent

from space_robot.view.arrows import ArrowSize, arrow_glb
from space_robot.view.glb import grid_faces, unlit_glb

trimesh = pytest.importorskip("trimesh")

NO_LINES = np.empty((0, 2), np.int64)


def test_triangles_are_as_trimesh_reads_them_and_lines_are_beside_them() -> None:
    rng = np.random.default_rng(3)
    vertices, colours = rng.normal(size=(7, 3)), rng.uniform(size=(7, 3))
    faces, lines = np.array([[0, 1, 2], [2, 1, 3]]), np.array([[4, 5], [5, 6]])
    data = unlit_glb(vertices, colours, faces, lines)
    scene = trimesh.load(io.BytesIO(data), "glb", process=False)
    (mesh,) = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
    np.testing.assert_allclose(mesh.vertices[mesh.faces], vertices[faces], atol=1e-6)
    content = GlbContent(data)
    np.testing.assert_array_equal(content.lines, lines)
    np.testing.assert_array_equal(content.vertices, vertices.astype(np.float32))


def test_colours_are_linear_and_no_light_changes_them() -> None:
    """Half of the light is 188 of 255 in CSS."""
    colours = np.full((3, 3), 188 / 255)
    content = GlbContent(unlit_glb(np.eye(3), colours, np.array([[0, 1, 2]]), NO_LINES))
    assert content.document["extensionsUsed"] == ["KHR_materials_unlit"]
    assert content.document["materials"] == [{"extensions": {"KHR_materials_unlit": {}}}]
    assert len(content.document["meshes"][0]["primitives"]) == 1
    np.testing.assert_allclose(content.colours, 0.5, atol=0.005)


@pytest.mark.parametrize("rings", [1, 2, 70, 300])
def test_many_vertices_have_longer_indices(rings: int) -> None:
    parts = 250
    vertices = np.random.default_rng(rings).normal(size=(rings * parts, 3))
    faces = grid_faces(rings, parts)
    assert len(faces) == 2 * parts * (rings - 1)
    if not len(faces):
        return
    data = unlit_glb(vertices, np.zeros_like(vertices), faces, NO_LINES)
    (mesh,) = trimesh.load(io.BytesIO(data), "glb", process=False).geometry.values()
    np.testing.assert_array_equal(mesh.faces, faces)


def test_an_arrow_is_closed_and_has_its_length() -> None:
    data = arrow_glb(ArrowSize(2.0, 3.0), (230, 159, 0))
    (mesh,) = trimesh.load(io.BytesIO(data), "glb").geometry.values()
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    assert mesh.is_watertight
    assert mesh.volume > 0.0  # its faces look outwards
    np.testing.assert_allclose(mesh.bounds[:, 2], [0.0, 2.0], atol=1e-6)
