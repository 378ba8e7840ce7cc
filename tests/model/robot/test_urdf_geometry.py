"""URDFs: dynamics, shapes, frames, limits, repairs; any text makes a robot or one line."""

from __future__ import annotations

import contextlib
import io
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import TreeOracle, assert_same_dynamics
from paths import DATA
from strategies import (
    MOMENTS,
    SEEDS,
    random_inertia,
    random_origin,
    random_rotation,
    random_urdf,
    words,
)

from space_robot.cli.main import _run
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.flatten import SETTINGS_FRICTION
from space_robot_model.robot.inertia import SLENDER, inertia_tensor
from space_robot_model.robot.parts import Base, Body, Visual
from space_robot_model.robot.urdf import Mount, UrdfRobot, mounted_urdf, read_urdf
from space_robot_model.robot.urdf_tree import solid_inertia
from space_robot_msgs_py.errors import InputError

FILE = Path("random.urdf")
SHAPES = ('<box size="1 2 3"/>', '<cylinder radius="1" length="2"/>', '<sphere radius="0.5"/>')


def dressed(rng: np.random.Generator, count: int) -> str:
    """A random URDF with a shape on every link, and ranges and friction of every joint."""

    def shape(match: re.Match[str]) -> str:
        geometry = f"<geometry>{rng.choice(SHAPES)}</geometry>"
        return f"{match[0]}<visual>{random_origin(rng)}{geometry}</visual>"

    def limit(_: re.Match[str]) -> str:
        low, high = np.sort(rng.uniform(-3.0, 3.0, 2)).tolist()
        velocity, effort, damping, friction = rng.uniform(0.1, 9.0, 4).tolist()
        return (
            f'<limit lower="{low!r}" upper="{high!r}" velocity="{velocity!r}" '
            f'effort="{effort!r}"/><dynamics damping="{damping!r}" friction="{friction!r}"/>'
        )

    text = re.sub(r'<link name="\w+">', shape, random_urdf(rng, count))
    return re.sub(r"<limit [^>]*/>", limit, text)


def body_poses(robot: Robot, positions: Array) -> list[pin.SE3]:
    """The frame of each body on the base's, by the definition of a robot's numbers."""
    poses = [pin.SE3.Identity()] * len(robot.body_names)
    for joint in robot.order:
        turn, offset, z = robot.rotation[joint], robot.offset[joint], np.array([0.0, 0.0, 1.0])
        moved = pin.SE3(np.eye(3), z * positions[joint])
        if not robot.is_prismatic[joint]:
            moved = pin.SE3(pin.exp3(z * positions[joint]), np.zeros(3))
        poses[joint + 1] = poses[robot.parent[joint]] * pin.SE3(turn, turn @ offset) * moved
    return poses


def assert_same_places(ours: list[pin.SE3], theirs: list[pin.SE3]) -> None:
    """Each seen from the first one, so that it does not matter what the base's frame is."""
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(
            (ours[0].inverse() * one).homogeneous,
            (theirs[0].inverse() * other).homogeneous,
            atol=1e-12,
        )


@settings(max_examples=40)
@given(seed=SEEDS, count=st.integers(1, 9))
def test_shapes_and_frames_are_where_pinocchio_has_them(seed: int, count: int) -> None:
    """Of merged links and of joints that another base turns round, in any configuration."""
    rng = np.random.default_rng(seed)
    text = dressed(rng, count)
    model = pin.buildModelFromXML(text)
    data, angles = model.createData(), dict[str, float]()
    q = pin.neutral(model)
    for name, joint in zip(model.names[1:], model.joints[1:], strict=True):
        angle = angles[name] = float(rng.uniform(-3.0, 3.0))
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
        )
    pin.framesForwardKinematics(model, data, q)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.VISUAL)
    placed = {
        shape.name.rpartition("_")[0]: data.oMi[shape.parentJoint] * shape.placement
        for shape in shapes.geometryObjects
    }
    links = [f"link{k}" for k in range(count + 1)]
    masses = [part.name for part in parts(read_urdf(FILE, text=text)) if part.mass]
    for base in ("link0", str(rng.choice(masses))):
        found = read_urdf(FILE, base, tools=links, text=text)
        robot = Robot.from_tree(found.tree)
        poses = body_poses(robot, np.array([angles[name] for name in robot.joint_names]))
        tools = [poses[t.body] * pin.SE3(t.rotation, t.position) for t in robot.tools]
        assert [tool.name for tool in robot.tools] == links
        assert_same_places(tools, [data.oMf[model.getFrameId(link)] for link in links])
        seen = [poses[v.body] * pin.SE3(v.rotation, v.position) for v in robot.visuals]
        # a body's shapes are in the order of its links; which link one is of is told by its place
        assert len(seen) == len(placed)
        here, there = tools[0], data.oMf[model.getFrameId("link0")]
        wanted = [there.inverse() * place for place in placed.values()]
        for shape in seen:
            gaps = [np.abs((here.inverse() * shape).homogeneous - w.homogeneous) for w in wanted]
            wanted.pop(int(np.argmin([gap.max() for gap in gaps])))
            assert min(gap.max() for gap in gaps) < 1e-12


INERTIAL = (
    '<inertial>{at}<mass value="300.0"/><inertia ixx="60.0" iyy="50.0" izz="40.0" ixy="1.5" '
    'ixz="-2.0" iyz="0.5"/></inertial>'
)
SATELLITE = f'<link name="{{name}}">{INERTIAL}<visual><geometry><box size="1 1 1"/></geometry>'
SATELLITE += '<material name="grey"/></visual></link><material name="grey"/>'


@pytest.mark.parametrize("has_file", [True, False])
def test_a_mounted_arm_is_pinocchios_of_a_urdf_written_by_hand(
    has_file: bool, tmp_path: Path
) -> None:
    """On a satellite with a link of the name of the arm's, or on one of mass and inertia."""
    name, at = ("base_link", '<origin xyz="0.1 0.2 0.3"/>') if has_file else ("satellite", "")
    satellite, file = SATELLITE.format(name=name, at=at), tmp_path / "sat.urdf"
    file.write_text(f'<robot name="sat">{satellite}</robot>')
    xyz, rpy = (0.5, -0.2, 0.6), (0.3, -1.2, 0.4)
    inertia = [60.0, 50.0, 40.0, 1.5, -2.0, 0.5]
    mount = Mount(file, xyz=xyz, rpy=rpy) if has_file else Mount(None, 300.0, inertia, xyz, rpy)
    mounted = mounted_urdf(DATA / "ground_arm.urdf", mount, repair=False)
    assert mounted.name == ("ground_arm_on_sat" if has_file else "ground_arm_on_satellite")
    robot = Robot.from_tree(read_urdf(FILE, text=mounted.text).tree)
    assert robot.joint_names == ("shoulder", "elbow")
    arm = (DATA / "ground_arm.urdf").read_text("utf-8").replace('"base_link"', '"foot"')
    seat = f'<origin xyz="{words(list(xyz))}" rpy="{words(list(rpy))}"/><parent link="{name}"/>'
    joint = f'<joint name="m" type="fixed">{seat}<child link="world"/></joint></robot>'
    arm = arm.replace('"grey"', '"g"').replace("</robot>", f"{satellite}{joint}")
    model = pin.buildModelFromXML(arm, pin.JointModelFreeFlyer())
    assert_same_dynamics(robot, TreeOracle(model, name, robot.joint_names, 3), 3)


def one_joint(limit: str, dynamics: str = "", inertia: str = "") -> UrdfRobot:
    """A hull and an arm with a plate fixed to it, repaired."""
    ball = '<mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    text = (
        f'<robot name="r"><link name="hull"><inertial>{ball}</inertial></link>'
        f'<link name="arm"><inertial>{ball}</inertial></link><link name="plate">{inertia}</link>'
        '<joint name="j" type="revolute"><parent link="hull"/><child link="arm"/>'
        f'<axis xyz="0 0 1"/>{limit}{dynamics}</joint>'
        '<joint name="glue" type="fixed"><parent link="arm"/><child link="plate"/></joint></robot>'
    )
    return read_urdf(FILE, repair=True, text=text)


INF = np.inf


@pytest.mark.parametrize(
    ("given", "limits", "findings"),
    [
        ('lower="-2" upper="-1" velocity="3" effort="4"', (-2.0, -1.0, 3.0, 4.0), 0),
        ('lower="1" upper="2" velocity="3" effort="4"', (1.0, 2.0, 3.0, 4.0), 0),
        ('upper="2" velocity="3" effort="4"', (0.0, 2.0, 3.0, 4.0), 0),
        ('lower="-2" velocity="3" effort="4"', (-2.0, 0.0, 3.0, 4.0), 0),
        ('lower="-1" upper="-2" velocity="3" effort="4"', (-2.0, -1.0, 3.0, 4.0), 1),
        ('lower="5" upper="2" velocity="-3" effort="-4"', (2.0, 5.0, 3.0, 4.0), 3),
        ('lower="2" upper="2" velocity="0" effort="4"', (-INF, INF, INF, 4.0), 2),
        ('velocity="3"', (-INF, INF, 3.0, INF), 2),
        ('lower="-inf" upper="inf" velocity="inf" effort="1e12"', (-INF, INF, INF, INF), 0),
        ('lower="-inf" upper="-1" velocity="3" effort="inf"', (-INF, -1.0, 3.0, INF), 0),
    ],
)
def test_the_numbers_of_limits(given: str, limits: tuple[float, ...], findings: int) -> None:
    found = one_joint(f"<limit {given}/>")
    (joint,) = (link for link in found.tree.links if link.name == "arm")
    assert tuple(joint.limits) == limits
    assert len(found.findings) == findings, found.findings


@pytest.mark.parametrize(
    ("given", "coulomb", "viscous", "findings"),
    [
        ("", np.nan, np.nan, 0),
        ("<dynamics/>", 0.0, 0.0, 0),
        ('<dynamics friction="1"/>', 1.0, 0.0, 0),
        ('<dynamics damping="2"/>', 0.0, 2.0, 0),
        ('<dynamics damping="2" friction="-1"/>', 0.0, 2.0, 1),
        ('<dynamics damping="-2" friction="1"/>', 1.0, 0.0, 1),
    ],
)
def test_the_numbers_of_friction(given: str, coulomb: float, viscous: float, findings: int) -> None:
    found = one_joint('<limit lower="-1" upper="1" velocity="1" effort="1"/>', given)
    (joint,) = (link for link in found.tree.links if link.name == "arm")
    np.testing.assert_array_equal(joint.friction or SETTINGS_FRICTION, (coulomb, viscous))
    assert len(found.findings) == findings


def parts(urdf: UrdfRobot) -> list[Base | Body]:
    return [urdf.tree.base, *urdf.tree.links]


def mujoco_inertia(shape: str, size: tuple[float, ...], mass: float, turn: Array) -> Array:
    """What MuJoCo computes for a homogeneous geom about its centre, on the body's axes."""
    sizes = {
        "box": lambda: [0.5 * edge for edge in size],
        "cylinder": lambda: [size[0], 0.5 * size[1]],
        "sphere": lambda: [size[0]],
    }[shape]()
    quat = pin.Quaternion(turn).coeffs()[[3, 0, 1, 2]]
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body><freejoint/><geom type="{shape}" size="{words(sizes)}" '
        f'mass="{mass!r}" quat="{words(quat)}"/></body></worldbody></mujoco>'
    )
    w, x, y, z = model.body_iquat[1]
    axes = pin.Quaternion(w, x, y, z).matrix()
    inertia: Array = axes @ np.diag(model.body_inertia[1]) @ axes.T
    return inertia


@settings(max_examples=25)
@given(seed=SEEDS, shape=st.sampled_from(["box", "cylinder", "sphere"]))
def test_a_solid_of_a_shape_has_mujocos_inertia(seed: int, shape: str) -> None:
    rng = np.random.default_rng(seed)
    count = {"box": 3, "cylinder": 2, "sphere": 1}[shape]
    size = tuple(rng.uniform(0.1, 2.0, count).tolist())
    mass, turn = float(rng.uniform(0.5, 50.0)), random_rotation(rng)
    mesh = Visual("mesh", (1.0, 1.0, 1.0), np.eye(3), np.zeros(3), "x.stl")
    other = Visual("sphere", (9.0,), np.eye(3), np.zeros(3))
    seen = Visual(shape, size, turn, rng.uniform(-1.0, 1.0, 3))  # type: ignore[arg-type]
    inertia, _ = solid_inertia(mass, (mesh, seen, other))
    np.testing.assert_allclose(
        inertia, mujoco_inertia(shape, size, mass, turn), rtol=1e-6, atol=1e-9 * mass
    )


def nearest(inertia: Array) -> Array:
    """Second moments with those below a thousandth of the largest raised to it, by NumPy."""
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments, axes = np.linalg.eigh(second)
    raised = axes @ np.diag(np.maximum(moments, SLENDER * moments.max())) @ axes.T
    return np.asarray(np.trace(raised) * np.eye(3) - raised)


def with_inertia(mass: float, tensor: Array) -> str:
    values = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
    moments = " ".join(f'{name}="{value!r}"' for name, value in zip(MOMENTS, values, strict=True))
    place = '<origin xyz="0.1 0.2 0.3"/>'
    return f'<inertial>{place}<mass value="{mass!r}"/><inertia {moments}/></inertial>'


LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'


@settings(max_examples=30)
@given(seed=SEEDS, share=st.floats(1.02, 3.0))
def test_a_fixed_link_that_breaks_the_triangle_is_raised_like_any_other(
    seed: int, share: float
) -> None:
    """By the number, though the merged body as a whole might pass; of a sound one nothing is."""
    rng = np.random.default_rng(seed)
    turn = random_rotation(rng)
    a, b = rng.uniform(0.01, 0.1, 2)
    bad = turn @ np.diag([a, b, share * (a + b)]) @ turn.T
    found = one_joint(LIMIT, inertia=with_inertia(3.0, bad))
    (plate,) = (link for link in found.tree.links if link.name == "plate")
    np.testing.assert_allclose(plate.inertia, nearest(bad), atol=1e-12)
    assert [finding.part for finding in found.findings] == ["link 'plate'"]
    good = inertia_tensor(random_inertia(rng, 0.1))
    sound = one_joint(LIMIT, inertia=with_inertia(3.0, good))
    assert not sound.findings
    np.testing.assert_array_equal(sound.tree.links[-1].inertia, good)


def test_a_point_may_be_fixed_to_a_solid_body_only() -> None:
    """Its inertia, zero, is no defect there; where nothing beside it is solid it is one."""
    point = with_inertia(3.0, np.zeros((3, 3)))
    found = one_joint(LIMIT, inertia=point)
    assert not found.findings
    assert not found.tree.links[-1].inertia.any()
    moving = one_joint(LIMIT, inertia=point).text.replace('type="fixed"', 'type="continuous"')
    repaired = read_urdf(FILE, repair=True, text=moving)
    assert [finding.part for finding in repaired.findings] == ["link 'plate'"]
    radius = (3.0 * 3.0 / (4.0 * np.pi * 1000.0)) ** (1.0 / 3.0)
    np.testing.assert_allclose(
        repaired.tree.links[-1].inertia, 0.4 * 3.0 * radius**2 * np.eye(3), rtol=1e-12
    )


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 2), count=st.integers(1, 12))
def test_random_trees(tmp_path_factory: pytest.TempPathFactory, seed: int, count: int) -> None:
    """Branches, fixed and prismatic joints, offsets, turned inertias, any axis, any base."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, count)
    path = tmp_path_factory.getbasetemp() / "tree.urdf"
    path.write_text(text)
    heavy = [part.name for part in parts(read_urdf(path)) if part.mass]
    for base in ("link0", str(rng.choice(heavy))):
        robot = Robot.from_urdf(path, base=base)
        model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
        oracle = TreeOracle(model, base, robot.joint_names, seed)
        assert_same_dynamics(robot, oracle, seed)


# Whatever becomes of a URDF, there is a robot that can fly or one error of one line

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


@settings(max_examples=150)
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
                robot = Robot.from_tree(found.tree, where=str(path))
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
