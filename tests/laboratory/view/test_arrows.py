"""Arrows at the base point to where the Earth, the orbit and the Sun are."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from space_robot.view.arrows import (
    ArrowSize,
    BaseArrows,
    arrow_directions,
    arrow_kinds,
    turns_from_z,
)
from space_robot.view.palette import palette
from space_robot_model.robot import Robot

VECTORS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 1e-3)
Z = np.array([0.0, 0.0, 1.0])


@given(st.lists(st.one_of(VECTORS, st.just((0.0, 0.0, -1.0))), min_size=1, max_size=4))
def test_a_turn_brings_z_to_the_direction(vectors: list[tuple[float, ...]]) -> None:
    directions = np.array([np.array(v) / np.linalg.norm(v) for v in vectors])
    turns = Rotation.from_quat(turns_from_z(directions), scalar_first=True)
    np.testing.assert_allclose(turns.apply(Z), directions, atol=1e-6)


@pytest.mark.parametrize("dark", [True, False])
def test_each_arrow_has_a_colour_of_the_page(dark: bool) -> None:
    kinds = arrow_kinds(True, dark)
    assert [kind.name for kind in kinds] == ["nadir", "orbital velocity", "Sun"]
    colours = [kind.colour for kind in kinds]
    assert len(set(colours)) == 3
    assert set(colours) <= set(palette(dark))
    assert not set(colours) & set(palette(dark)[:2])  # those of the first flights
    assert arrow_kinds(False, dark) == kinds[:2]


class FakeScene:
    """Keeps the frames and labels that are added."""

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}

    def add_frame(self, path: str, **_: object) -> Any:
        self.nodes[path] = SimpleNamespace(position=np.zeros(3), wxyz=np.array([1.0, 0, 0, 0]))
        return self.nodes[path]

    def add_label(self, path: str, text: str, position: tuple[float, ...]) -> None:
        self.nodes[path] = SimpleNamespace(text=text, position=position)

    def add_glb(self, path: str, data: bytes, **_: object) -> None:
        self.nodes[path] = SimpleNamespace(data=data)


def test_they_stand_at_the_base_and_have_labels() -> None:
    scene: Any = FakeScene()
    size, sun = ArrowSize(1.5, 4.0), np.array([0.6, 0.0, 0.8])
    arrows = BaseArrows(scene, "/one", size, arrow_kinds(True, True))
    base, position = np.array([0.1, 0.2, 0.3]), np.array([3e6, 4e6, -5e6])
    velocity = np.array([-4e3, 3e3, 1.0])
    directions = arrow_directions(position, velocity, sun)
    arrows.move(base, directions)
    np.testing.assert_array_equal(scene.nodes["/one/orbit"].position, base)
    expected = {
        "nadir": -position / np.linalg.norm(position),
        "orbital_velocity": velocity / np.linalg.norm(velocity),
        "Sun": sun,
    }
    for name, direction in expected.items():
        turn = Rotation.from_quat(scene.nodes[f"/one/orbit/{name}"].wxyz, scalar_first=True)
        np.testing.assert_allclose(turn.apply(Z), direction, atol=1e-8)
        label = scene.nodes[f"/one/orbit/{name}/label"]
        assert label.text == name.replace("_", " ")
        assert label.position[2] > size.length
    assert len(arrow_directions(position, velocity, None)) == 2


def test_they_reach_out_of_the_base(paper_robot: Robot) -> None:
    """The paper's base is a cube of 1 m."""
    seen = np.array([[0.0, 0.0, 0.0], [5.0, 1.0, 1.0]])
    size = ArrowSize.of(paper_robot, seen)
    assert size.size == 5.0
    assert np.sqrt(0.75) + 0.5 < size.length < 2.5
