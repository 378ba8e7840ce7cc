"""Whatever becomes of a URDF, there is a robot that can fly or one error of one line."""

from __future__ import annotations

import contextlib
import io
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import DATA
from strategies import random_urdf

from space_robot.cli.main import _run
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.urdf import read_urdf
from space_robot_msgs_py.errors import InputError

GOOD = (DATA / "arm.urdf").read_text()
VALUES = (
    *("", "0", "-1", "1e-300", "1e-12", "1e11", "1e400", "nan", "inf", "-inf", "0x1", "1_000", "٣"),
    *("0 0 0", "0 0 1e-9", "1 2 3 4", "0 0 nan", "hull", "upper", "fore", "hand", "shoulder"),
    *("fixed", "floating", "continuous", "prismatic", "&#10;", "&lt;", "💥", "x" * 300, "base_x"),
)
PIECES = ("<", ">", "/>", "\0", "&", '"', "<!--", "]]>", "<link/>", "<?xml?>", "\ud800", "\n", "é")


@st.composite
def cut_texts(draw: st.DrawFn) -> str:
    """Slices of the text cut out, repeated, or replaced by odd pieces."""
    text = GOOD
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        stop = start + draw(st.integers(0, 60))
        piece = draw(st.sampled_from((*PIECES, text[start:stop] * 2, "")))
        text = text[:start] + piece + text[stop:]
    return text


@st.composite
def odd_values(draw: st.DrawFn) -> str:
    text = GOOD
    for _ in range(draw(st.integers(1, 3))):
        places = list(re.finditer(r'(?<==")[^"]*(?=")', text))
        place = draw(st.sampled_from(places[1:]))
        text = text[: place.start()] + draw(st.sampled_from(VALUES)) + text[place.end() :]
    return text


@st.composite
def moved_elements(draw: st.DrawFn) -> str:
    """Elements are lost, doubled, moved into others, or get others' names."""
    random = random_urdf(np.random.default_rng(draw(st.integers(0, 99))), 6)
    root = ET.fromstring(GOOD if draw(st.booleans()) else random)
    for _ in range(draw(st.integers(1, 4))):
        parents = [parent for parent in root.iter() if len(parent)]
        if not parents:
            break
        parent = draw(st.sampled_from(parents))
        child = draw(st.sampled_from(list(parent)))
        act = draw(st.sampled_from(("lose", "double", "move", "rename")))
        if act == "rename":
            child.tag = draw(st.sampled_from([element.tag for element in root.iter()]))
        if act in ("lose", "move"):
            parent.remove(child)
        if act == "double":
            parent.append(child)
        if act == "move":
            draw(st.sampled_from([e for e in root.iter() if e is not child])).append(child)
    return ET.tostring(root, encoding="unicode")


@st.composite
def wrong_bytes(draw: st.DrawFn) -> bytes:
    data = bytearray(GOOD.encode())
    for _ in range(draw(st.integers(1, 8))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return bytes(data)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz") / "fuzzed.urdf"


def said_by_the_command(path: Path) -> str:
    """The one line of a command that was to fly what nobody flies: a good one has no mission."""
    err = io.StringIO()
    with contextlib.redirect_stderr(err):
        code = _run(["simulate", "--robot", str(path)])
    said = err.getvalue()
    assert (code, said.count("\n")) == (2, 1)
    assert said.startswith("space-robot: error: ")
    return said


@settings(max_examples=250)
@given(
    text=cut_texts() | odd_values() | moved_elements() | wrong_bytes(),
    base=st.sampled_from([None, "hull", "fore", "hand", "link1"]),
)
def test_a_robot_or_one_line(path: Path, text: str | bytes, base: str | None) -> None:
    path.write_bytes(text if isinstance(text, bytes) else text.encode(errors="replace"))
    said_outside = said_by_the_command(path)
    for repair in (False, True):
        try:
            with np.errstate(all="raise", under="ignore"):
                found = read_urdf(path, base, repair)
                robot = Robot.of_tree(found.name, found.bodies, where=str(path))
        except InputError as error:
            said = str(error)
            assert said.isprintable()
            assert str(path) in said
            assert len(said) < 1000
            assert repair or base or said in said_outside
        else:
            flown = find_robot(str(path), base, repair)
            assert flown.joint_names == robot.joint_names
            assert np.all(robot.mass > 0.0)
            assert np.all(np.linalg.eigvalsh(robot.inertia) > 0.0)
            for array in (robot.com, robot.rotation, robot.offset, robot.inertia):
                assert np.all(np.isfinite(array))
            assert all(limit.lower < limit.upper for limit in robot.limits)
            assert all(len(str(finding).splitlines()) == 1 for finding in found.findings)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_urdf(tmp_path / "nothing.urdf")
    with pytest.raises(InputError, match="not a file"):
        read_urdf(tmp_path)
