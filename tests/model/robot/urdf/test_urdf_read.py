"""What a URDF says arrives in the robot: joints, limits, frames, tools, shapes, springs."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from paths import DATA

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import JointFriction, JointLimits, Spring
from space_robot_model.robot.urdf import read_urdf
from space_robot_model.robot.urdf.inertia import inertia_defect, nearest_inertia, solid_inertia
from space_robot_model.robot.urdf_file import complete_content
from space_robot_msgs_py.errors import InputError

ARM = DATA / "arm.urdf"
TEXT = ARM.read_text()


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.from_urdf(ARM)


def test_joints_and_bodies(arm: Robot) -> None:
    assert (arm.name, arm.joint_names) == ("arm", ("shoulder", "slide"))
    assert arm.mass.tolist() == [300.0, 20.0, 10.0]
    assert arm.is_prismatic.tolist() == [False, True]
    assert arm.limits == (JointLimits(-1.0, 2.0, 0.1, 50.0), JointLimits(0.0, 0.6, 0.05, 20.0))
    assert arm.friction[0] == JointFriction(0.3, 0.4)
    assert np.all(np.isnan(arm.friction[1]))  # the settings' hold
    assert arm.repairs == ()


def test_the_base_has_its_frame_at_the_com_and_the_axes_of_the_link(arm: Robot) -> None:
    c, s = np.cos(0.2), np.sin(0.2)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    assert_allclose(arm.inertia[0], turn @ np.diag([40.0, 50.0, 60.0]) @ turn.T, atol=1e-13)
    box = next(visual for visual in arm.visuals if visual.body == 0)
    assert_allclose(box.position, [-0.1, 0.0, 0.5])
    assert (box.shape, box.size, box.colour) == ("box", (1.0, 1.0, 2.0), (0.2, 0.2, 0.2, 1.0))


def test_the_axis_becomes_z(arm: Robot) -> None:
    """The shoulder turns about y of the link; at zero, that is y of the base."""
    assert_allclose(arm.rotation[0][:, 2], [0.0, 1.0, 0.0], atol=1e-15)
    assert_allclose(arm.rotation[0] @ arm.offset[0], [0.4, 0.0, 1.0], atol=1e-15)
    down = arm.rotation[0] @ arm.rotation[1][:, 2]
    assert_allclose(down, [-1.0, 0.0, 0.0], atol=1e-15)  # -z of a link that lies on its side


def test_tools_and_shapes_of_merged_links(arm: Robot) -> None:
    assert [tool.name for tool in arm.tools] == ["hand"]
    assert arm.tool.body == 2
    hand = next(visual for visual in arm.visuals if visual.shape == "sphere")
    assert hand.body == 2
    assert hand.colour == (1.0, 0.0, 0.0, 1.0)
    assert_allclose(hand.position, arm.tool.position)
    mesh = next(visual for visual in arm.visuals if visual.shape == "mesh")
    assert (mesh.mesh, mesh.size) == ("package://arm/fore.stl", (2.0, 2.0, 2.0))


def test_another_base_turns_the_joints_round(arm: Robot) -> None:
    """The dynamics are compared in test_urdf_dynamics."""
    turned = Robot.from_urdf(ARM, base="hand")  # merged into fore
    assert turned.joint_names == arm.joint_names[::-1]
    assert turned.mass.tolist() == [10.0, 20.0, 300.0]
    assert turned.parent.tolist() == [0, 1]
    assert turned.limits == arm.limits[::-1]
    assert [tool.name for tool in turned.tools] == ["hull"]
    with pytest.raises(InputError, match=r"unknown link 'x' .*: choose one of hull, upper, fore"):
        Robot.from_urdf(ARM, base="x")


def test_tools_are_ordered_by_the_joints_before_them(tmp_path: Path) -> None:
    camera = '<link name="camera"/><joint name="c" type="fixed"><parent link="hull"/>'
    text = TEXT.replace('<link name="upper">', f'{camera}<child link="camera"/></joint>\\g')
    path = tmp_path / "two.urdf"
    path.write_text(text.replace("\\g", '<link name="upper">'))
    assert [tool.name for tool in Robot.from_urdf(path).tools] == ["hand", "camera"]
    chosen = read_urdf(path, tools=["upper", "camera"])
    robot = Robot.of_tree(chosen.name, chosen.bodies)
    assert [(tool.name, tool.body) for tool in robot.tools] == [("upper", 1), ("camera", 0)]
    with pytest.raises(InputError, match="unknown link 'x' for a tool"):
        read_urdf(path, tools=["x"])
    with pytest.raises(InputError, match="tools: link 'camera' occurs twice"):
        read_urdf(path, tools=["camera", "upper", "camera"])


def test_a_branch_without_tool_frame_has_one_on_its_last_link(tmp_path: Path) -> None:
    path = tmp_path / "heavy.urdf"
    hand = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    path.write_text(TEXT.replace('<link name="hand">', f'<link name="hand">{hand}</inertial>'))
    assert [tool.name for tool in Robot.from_urdf(path).tools] == ["fore"]


class TestYaml:
    """A robot's YAML may refer to a URDF."""

    def content(self, **more: Any) -> dict[str, Any]:
        return {"robot": {"urdf": "arm.urdf", **more}}

    def read(self, **more: Any) -> Robot:
        return Robot.from_dict(self.content(**more), "given.yaml", DATA)

    def test_from_the_folder_of_the_yaml(self, tmp_path: Path) -> None:
        (tmp_path / "arm.urdf").write_text(TEXT)
        (tmp_path / "robot.yaml").write_text("robot: {urdf: arm.urdf, base: fore, name: mine}\n")
        robot = Robot.from_yaml(tmp_path / "robot.yaml")
        assert (robot.name, robot.mass[0]) == ("mine", 10.0)

    def test_springs_and_tools(self) -> None:
        spring = {"stiffness": 10.0, "damping": 0.5, "rest_deg": 0.1}
        robot = self.read(passive={"slide": spring}, tools=["fore"])
        assert (robot.joint_names, robot.passive_names) == (("shoulder",), ("slide",))
        assert robot.springs == (Spring(10.0, 0.5, 0.1),)
        assert robot.tool.name == "fore"
        turned = self.read(passive={"shoulder": spring})
        assert turned.springs[0].rest == pytest.approx(np.radians(0.1))
        assert turned.friction[1] == JointFriction(0.3, 0.0)

    def test_errors(self) -> None:
        with pytest.raises(InputError, match=r"unknown passive joint 'wrist' of given\.yaml"):
            self.read(passive={"wrist": {"stiffness": 1.0, "damping": 1.0}})
        with pytest.raises(InputError, match=r"given\.yaml: robot: either urdf or urdf_text"):
            self.read(urdf_text=TEXT)
        with pytest.raises(InputError, match="unknown key"):
            self.read(root="hull")

    def test_repairs_are_told(self) -> None:
        text = TEXT.replace('upper="2"', 'upper="-2"')
        robot = Robot.from_dict({"robot": {"urdf_text": text, "repair": True}})
        assert len(robot.repairs) == 1
        assert robot.limits[0].lower == -2.0

    def test_complete_in_itself(self, arm: Robot, tmp_path: Path) -> None:
        content = complete_content(self.content(base="upper"), DATA, "given.yaml")
        robot = Robot.from_dict(content, folder=tmp_path)
        assert robot.name == "arm"
        assert np.array_equal(robot.offset, self.read(base="upper").offset)


def test_visuals_are_as_the_file_says_wherever_it_is(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(TEXT.replace("package://arm/fore.stl", "meshes/fore.stl"))
    mesh = next(v for v in Robot.from_urdf(path).visuals if v.shape == "mesh")
    assert mesh.mesh == str(tmp_path / "meshes" / "fore.stl")


class TestInertia:
    """Which tensors matter can have."""

    @pytest.mark.parametrize("moments", [(1.0, 1.0, 3.0), (0.0, 0.0, 1.0), (-1.0, 5.0, 5.0)])
    def test_the_nearest_is_physical_and_near(self, moments: tuple[float, ...]) -> None:
        given = np.diag(moments)
        nearest = nearest_inertia(given)
        assert nearest is not None
        assert inertia_defect(1.0, nearest)[0] == ""
        second = 0.5 * np.sum(moments) - np.array(moments)
        near = 0.5 * np.trace(nearest) * np.eye(3) - nearest
        assert_allclose(np.diag(near), np.maximum(second, 1e-3 * np.max(second)), atol=1e-12)

    def test_none_is_near_to_the_negative(self) -> None:
        assert nearest_inertia(-np.eye(3)) is None

    def test_a_sphere_of_water(self) -> None:
        inertia, said = solid_inertia(4.0 / 3.0 * np.pi * 1000.0, ())
        assert_allclose(inertia, 0.4 * 4.0 / 3.0 * np.pi * 1000.0 * np.eye(3))
        assert "1 m" in said

    def test_shapes(self, arm: Robot) -> None:
        box = tuple(v for v in arm.visuals if v.shape == "box")
        assert_allclose(np.diag(solid_inertia(12.0, box)[0]), [5.0, 5.0, 2.0])


class TestXacro:
    """Xacro is expanded by the package of that name, if it is there."""

    def test_not_installed(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "xacro", None)
        path = tmp_path / "arm.xacro"
        path.write_text(TEXT)
        with pytest.raises(InputError, match=r"xacro is not installed: `pip install xacro"):
            Robot.from_urdf(path)

    def test_what_it_says_becomes_one_line(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def process_file(_: str) -> None:
            print("when processing\nfile: x", file=sys.stderr)
            raise SystemExit("No such\nfile")

        monkeypatch.setitem(sys.modules, "xacro", SimpleNamespace(process_file=process_file))
        path = tmp_path / "arm.xacro"
        path.write_text(TEXT)
        with pytest.raises(InputError, match=r"cannot expand it \(No such file when processing"):
            Robot.from_urdf(path)

    def test_macros(self, arm: Robot, tmp_path: Path) -> None:
        pytest.importorskip("xacro")
        path = tmp_path / "arm.xacro"
        text = TEXT.replace('name="arm"', 'name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"')
        text = text.replace("<material", '<xacro:property name="m" value="150"/><material', 1)
        path.write_text(text.replace('"300"', '"${2 * m}"'))
        robot = Robot.from_urdf(path)
        assert np.array_equal(robot.mass, arm.mass)
        assert np.array_equal(robot.inertia, arm.inertia)
