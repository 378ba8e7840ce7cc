"""What a URDF says arrives in the robot; what is wrong with it is one line, with the repair."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from paths import DATA
from urdf_defects import DEFECTS, GOOD

from space_robot_model.robot import Robot
from space_robot_model.robot.inertia import nearest_inertia
from space_robot_model.robot.parts import MOST_LINKS, JointFriction, JointLimits, Spring
from space_robot_model.robot.urdf import MOST_MOVING, read_urdf
from space_robot_model.robot.urdf_links import mesh_path
from space_robot_msgs_py.errors import InputError

ARM = DATA / "arm.urdf"
MASS = '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
MATTER = f"<inertial>{MASS}</inertial>"


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.from_urdf(ARM)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "given.urdf"


@pytest.mark.parametrize("name", DEFECTS)
def test_a_defect_is_one_line_with_the_repair_which_leaves_a_robot(name: str, path: Path) -> None:
    defect = DEFECTS[name]
    path.write_text(defect.urdf)
    with pytest.raises(InputError) as raised:
        Robot.from_urdf(path)
    said = str(raised.value)
    assert "\n" not in said
    line = f"line {defect.line}: " if defect.line else ""
    assert said.startswith(f"{path}: {line}{defect.part}")
    assert defect.text in said
    assert ("(with --repair: " in said) == bool(defect.repair)
    if not defect.repair:
        with pytest.raises(InputError) as raised:
            read_urdf(path, repair=True)
        assert str(raised.value) == said
        return
    assert f"(with --repair: {defect.repair}" in said
    found = read_urdf(path, repair=True)
    first = found.findings[0]
    assert str(first).startswith(f"line {defect.line}: {defect.part}: ")
    assert defect.repair in first.repair
    assert "\n" not in "".join(map(str, found.findings))
    robot = Robot.from_tree(found.tree)
    assert robot.n == (1 if "locked" in first.repair else 2)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<robot name", '<robot xmlns:xacro="http://x" version="1.0" name'),
        ("</robot>", "<gazebo><plugin/></gazebo><transmission/><ros2_control/></robot>"),
        ("</visual>\n  </link>", "</visual><collision/><drake:x/>\n  </link>"),
        ('<child link="hand"/>', '<child link="hand"/><axis xyz="0 0 0"/><limit/>'),
        ('revolute">', 'continuous">'),
        ("fore.stl", "nowhere.stl"),
        ('"0 1 0"', '"0 0.9999 0"'),
        ('lower="0" upper="0.6"', 'lower="-inf" upper="inf"'),
        ('<material name="grey"/>', '<material name="nobody knows it"/>'),
    ],
)
def test_what_is_no_defect(old: str, new: str, path: Path) -> None:
    assert old in GOOD
    path.write_text(GOOD.replace(old, new, 1))
    assert Robot.from_urdf(path).n == 2


def test_all_defects_are_counted(path: Path) -> None:
    path.write_text(DEFECTS["no limit"].urdf.replace('iyy="50"', 'iyy="-5"'))
    with pytest.raises(InputError, match=r"line 7: .*\(and 1 more\)$"):
        read_urdf(path)
    assert [finding.line for finding in read_urdf(path, repair=True).findings] == [7, 37]


def test_no_inertia_is_near_to_a_negative_one() -> None:
    assert nearest_inertia(-np.eye(3)) is None
    assert nearest_inertia(np.diag([-1.0, 5.0, 5.0])) is not None


def test_next_to_no_mass_has_no_inertia(path: Path) -> None:
    """Else it would be added, unphysical perhaps, to that of the link it is merged into."""
    path.write_text(GOOD.replace('<mass value="10"/>', '<mass value="1e-12"/>'))
    found = read_urdf(path, repair=True)
    assert [finding.repair.split()[-1] for finding in found.findings] == ["'upper'", "ignored"]
    robot = Robot.from_tree(found.tree)
    assert_allclose(np.linalg.eigvalsh(robot.inertia[1]), [0.5, 1.9, 2.1])


def test_joints_bodies_and_shapes(arm: Robot) -> None:
    """Dynamics and places are Pinocchio's in test_urdf_geometry."""
    assert (arm.name, arm.joint_names) == ("arm", ("shoulder", "slide"))
    assert arm.mass.tolist() == [300.0, 20.0, 10.0]
    assert arm.is_prismatic.tolist() == [False, True]
    assert arm.limits == (JointLimits(-1.0, 2.0, 0.1, 50.0), JointLimits(0.0, 0.6, 0.05, 20.0))
    assert arm.friction[0] == JointFriction(0.3, 0.4)
    assert np.all(np.isnan(arm.friction[1]))  # the settings' hold
    assert arm.repairs == ()
    assert [(tool.name, tool.body) for tool in arm.tools] == [("hand", 2)]
    shapes = {visual.shape: visual for visual in arm.visuals}
    box, hand, mesh = (shapes[name] for name in ("box", "sphere", "mesh"))
    assert (box.body, box.size, box.colour) == (0, (1.0, 1.0, 2.0), (0.2, 0.2, 0.2, 1.0))
    assert (hand.body, hand.colour) == (2, (1.0, 0.0, 0.0, 1.0))
    assert (mesh.mesh, mesh.size) == ("package://arm/fore.stl", (2.0, 2.0, 2.0))


def test_another_base_turns_the_joints_round(arm: Robot) -> None:
    turned = Robot.from_urdf(ARM, base="hand")  # merged into fore
    assert turned.joint_names == arm.joint_names[::-1]
    assert turned.mass.tolist() == [10.0, 20.0, 300.0]
    assert turned.limits == arm.limits[::-1]
    assert [tool.name for tool in turned.tools] == ["hull"]
    with pytest.raises(InputError, match=r"unknown link 'x' .*: choose one of hull, upper, fore"):
        Robot.from_urdf(ARM, base="x")


def test_tools_are_ordered_by_the_joints_before_them(path: Path) -> None:
    """A branch without a tool's frame has one on its last link."""
    camera = '<link name="camera"/><joint name="c" type="fixed"><parent link="hull"/>'
    camera += '<child link="camera"/></joint><link name="upper">'
    path.write_text(GOOD.replace('<link name="upper">', camera))
    assert [tool.name for tool in Robot.from_urdf(path).tools] == ["hand", "camera"]
    chosen = read_urdf(path, tools=["upper", "camera"])
    robot = Robot.from_tree(chosen.tree)
    assert [(tool.name, tool.body) for tool in robot.tools] == [("upper", 1), ("camera", 0)]
    with pytest.raises(InputError, match="unknown link 'x' for a tool"):
        read_urdf(path, tools=["x"])
    with pytest.raises(InputError, match="tools: link 'camera' occurs twice"):
        read_urdf(path, tools=["camera", "upper", "camera"])
    path.write_text(GOOD.replace('<link name="hand">', f'<link name="hand">{MATTER}'))
    assert [tool.name for tool in Robot.from_urdf(path).tools] == ["fore"]


def of_yaml(**more: Any) -> Robot:
    """A robot's YAML may refer to a URDF."""
    return Robot.from_dict({"robot": {"urdf": "arm.urdf", **more}}, "given.yaml", DATA)


SPRING = {"stiffness": 10.0, "damping": 0.5, "rest_deg": 0.1}


def test_springs_and_tools_of_a_yaml() -> None:
    robot = of_yaml(passive={"slide": SPRING}, tools=["fore"])
    assert (robot.joint_names, robot.passive_names) == (("shoulder",), ("slide",))
    assert robot.springs == (Spring(10.0, 0.5, 0.1),)
    assert robot.tool.name == "fore"
    turned = of_yaml(passive={"shoulder": SPRING})
    assert turned.springs[0].rest == pytest.approx(np.radians(0.1))
    assert turned.friction[1] == JointFriction(0.3, 0.0)


def test_a_yaml_is_read_in_its_folder_or_has_the_text(tmp_path: Path) -> None:
    shutil.copy(ARM, tmp_path)
    (tmp_path / "robot.yaml").write_text("robot: {urdf: arm.urdf, base: fore, name: mine}\n")
    robot = Robot.from_yaml(tmp_path / "robot.yaml")
    assert (robot.name, robot.mass[0]) == ("mine", 10.0)
    text = GOOD.replace('upper="2"', 'upper="-2"')
    with pytest.raises(InputError, match="with --repair"):
        Robot.from_dict({"robot": {"urdf_text": text}})
    repaired = Robot.from_dict({"robot": {"urdf_text": text, "repair": True}})
    assert (len(repaired.repairs), repaired.limits[0].lower) == (1, -2.0)


def _not_found(_: str) -> None:
    print("when processing\nfile: x", file=sys.stderr)
    raise SystemExit("No such\nfile")


@pytest.mark.parametrize(
    ("module", "said"),
    [
        (None, r"xacro is not installed: `pip install xacro"),
        (SimpleNamespace(process_file=_not_found), r"cannot expand it \(No such file when process"),
    ],
)
def test_what_xacro_says_becomes_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: Any, said: str
) -> None:
    monkeypatch.setitem(sys.modules, "xacro", module)
    path = tmp_path / "arm.xacro"
    path.write_text(GOOD)
    with pytest.raises(InputError, match=said):
        Robot.from_urdf(path)


def test_macros(arm: Robot, tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    path = tmp_path / "arm.xacro"
    text = GOOD.replace('name="arm"', 'name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"')
    text = text.replace("<material", '<xacro:property name="m" value="150"/><material', 1)
    path.write_text(text.replace('"300"', '"${2 * m}"'))
    assert np.array_equal(Robot.from_urdf(path).mass, arm.mass)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("../meshes/fore.stl", "{}/arm/urdf/../meshes/fore.stl"),
        ("nowhere.stl", "{}/arm/urdf/nowhere.stl"),
        ("package://arm/meshes/fore.stl", "{}/arm/meshes/fore.stl"),
        ("model://arm/meshes/fore.stl", "{}/arm/meshes/fore.stl"),
        ("package://hand/meshes/palm.stl", "{}/hand/meshes/palm.stl"),
        ("package://leg/foot.stl", "{}/ros1/leg/foot.stl"),
        ("package://knee/cap.stl", "{}/ros2/share/knee/cap.stl"),
        ("file:///a/b%20c.stl", "/a/b c.stl"),
        ("/a/b.stl", "/a/b.stl"),
        *((name, name) for name in ("package://arm/x.stl", "package://", "http://x/y.stl")),
        ("package://arm/a\0b", "package://arm/a\0b"),
    ],
)
def test_where_a_mesh_is(
    name: str, found: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a package, in another one beside it, or installed; what nobody knows keeps its name."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}/ros2")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path}/ros1")
    own = ("arm/urdf/arm.urdf", "arm/meshes/fore.stl", "hand/meshes/palm.stl")
    for file in (*own, "ros1/leg/foot.stl", "ros2/share/knee/cap.stl"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    assert mesh_path(name, tmp_path / "arm/urdf") == found.format(tmp_path)


@pytest.mark.parametrize("base", [None, "fore"])
def test_a_plate_is_in_its_links_frame(base: str | None, tmp_path: Path) -> None:
    """Also where the base is not the URDF's root: the upper link gets another frame there.

    The link's cylinder is at the origin of its frame, with the same axes.
    """
    shutil.copy(ARM, tmp_path)
    plate: dict[str, Any] = {"area": 2.0, "normal": [0.6, 0.0, -0.8], "centre": [0.1, -0.2, 0.3]}
    plates = [{"link": link, **plate} for link in ("upper", "base", "hull")]
    content = {"robot": {"urdf": "arm.urdf", "base": base, "plates": plates}}
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content))
    robot = Robot.from_yaml(tmp_path / "arm.yaml")
    (cylinder,) = (visual for visual in robot.visuals if visual.shape == "cylinder")
    (found,) = (plate for plate in robot.plates if plate.body == cylinder.body)
    of_base = [plate.centre.tolist() for plate in robot.plates if plate.body == 0]
    centre = cylinder.position + cylinder.rotation @ np.array(plate["centre"])
    assert_allclose(found.centre, centre, atol=1e-15)
    assert_allclose(found.normal, cylinder.rotation @ np.array(plate["normal"]), atol=1e-15)
    assert (base is not None) == bool(np.linalg.norm(cylinder.position) > 0.1)
    assert of_base == [of_base[0]] * (2 if base is None else 1), "base is the satellite"


def chain(links: int, kind: str, matter: str = MATTER) -> str:
    joints = "".join(
        f'<link name="l{k}">{matter}</link><joint name="j{k}" type="{kind}"><parent link="l{k - 1}"'
        f'/><child link="l{k}"/></joint>'
        for k in range(1, links)
    )
    return f'<robot name="long"><link name="l0">{MATTER}</link>{joints}</robot>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (chain(MOST_LINKS + 1, "revolute"), "at most 4000 links can be read, got 4001"),
        (chain(MOST_LINKS + 1, "fixed"), "at most 4000 links can be read, got 4001"),
        (chain(MOST_MOVING + 2, "continuous", ""), "at most 64 moving joints .* got 257"),
    ],
)
def test_links_are_counted_before_one_is_read(
    text: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(*_: Any) -> None:
        raise AssertionError("a link was read")

    monkeypatch.setattr("space_robot_model.robot.urdf.read_links", read)
    with pytest.raises(InputError, match=said):
        read_urdf(Path("my.urdf"), text=text)
