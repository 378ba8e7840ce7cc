"""What derived shapes are drawn as: the same size, closed, and seen from outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.view.meshes import shown_shapes
from space_robot.view.solids import cone, foil, frame, panel, wheel
from space_robot.view.spacecraft import BACK_COLOUR, THICKNESS, panels_of_plates, parts_of
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.shapes import BASE_COLOUR, PANEL_COLOUR
from space_robot_model.robot.tree import Plate, Visual

trimesh = pytest.importorskip("trimesh")

EDGES = st.tuples(st.floats(0.1, 5.0), st.floats(0.1, 5.0), st.floats(0.1, 5.0))


def box(size: tuple[float, ...], colour: tuple[float, float, float, float]) -> Visual:
    return Visual("box", size, np.eye(3), np.zeros(3), colour=colour)


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


def test_wheels_and_cones_are_closed() -> None:
    for mesh in (wheel(0.2, 0.05), cone(0.1, 0.3, 0.5), cone(0.1, 0.0, 0.5)):
        solid = trimesh.Trimesh(*mesh, process=True)
        assert solid.volume > 0.0
        assert solid.is_winding_consistent


def test_the_panels_of_a_robot_are_drawn_with_cells_in_their_size() -> None:
    robot = find_robot("flexible_panels")
    panels = [shape for shape in shown_shapes(robot).shapes if shape.body > robot.n]
    assert len(panels) == 6
    for shape in panels:
        parts = parts_of(shape)
        assert [part.name for part in parts] == ["back", "cells"]
        size = np.sort(np.ptp(parts[1].mesh.vertices, axis=0))
        np.testing.assert_allclose(size[1:], [1.0, 1.2], rtol=0.08)  # as its file's head says


def test_what_a_file_draws_is_left_alone() -> None:
    assert parts_of(box((1.0, 1.0, 1.0), (0.1, 0.2, 0.3, 1.0))) == []
    assert parts_of(replace(box((1.0, 1.0, 1.0), BASE_COLOUR), colour=None)) == []
    ball = Visual("sphere", (1.0,), np.eye(3), np.zeros(3), colour=BASE_COLOUR)
    assert parts_of(ball) == []
    assert parts_of(box((1.0, 1.0, 1.0), PANEL_COLOUR)) == []  # on a spring, and not flat


def test_plates_beside_the_base_are_panels_of_their_area(paper_robot: Robot) -> None:
    up, aside = np.array([0.0, 0.0, 1.0]), np.array([0.0, 2.0, 0.0])
    plates = (
        Plate(4.0, up, aside),
        Plate(4.0, -up, aside),  # its other side
        Plate(1.0, up, np.array([0.0, 0.0, 0.63])),  # a face of the base
        Plate(2.0, np.array([0.6, 0.0, 0.8]), -aside, specular=0.7),
    )
    robot = replace(paper_robot, plates=plates)
    shapes = shown_shapes(robot).shapes
    first, second = shapes[len(shown_shapes(paper_robot).shapes) :]
    assert first.size == pytest.approx((2.0, 2.0, THICKNESS))
    assert second.size == pytest.approx((np.sqrt(2.0), np.sqrt(2.0), THICKNESS))
    np.testing.assert_allclose(second.rotation[:, 2], [0.6, 0.0, 0.8])
    assert (first.colour, second.colour) == (PANEL_COLOUR, BACK_COLOUR)
    assert list(panels_of_plates(paper_robot, shapes)) == []
