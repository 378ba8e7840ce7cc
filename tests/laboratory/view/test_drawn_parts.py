"""What is drawn of a robot: shapes, meshes of files, wheels that turn, plumes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_pages import Scene, moving_log, page_of
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from space_robot.view import shapes
from space_robot.view.actuators import (
    FASTEST,
    LARGEST_TURN,
    RADIUS,
    SATURATED,
    SHORTEST,
    STEP,
    ActuatorFrames,
    wheel_places,
    wheel_slowdown,
)
from space_robot.view.flights import ViewOptions
from space_robot.view.meshes import cone, foil, frame, panel
from space_robot.view.scene import RobotScene, local_server
from space_robot.view.shapes import (
    BACK_COLOUR,
    THICKNESS,
    BaseSurface,
    drawn_parts,
    plate_panels,
    read_mesh,
    read_meshes,
    shown_shapes,
    simplify,
)
from space_robot_control.allocation.settings import assumed_actuators
from space_robot_model.hardware.base_actuators import BaseActuatorSettings, WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.parts import Plate, Visual
from space_robot_model.robot.shapes import BASE_COLOUR, LINK_COLOUR, PANEL_COLOUR
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import RobotNames, Timebase

EDGES = st.tuples(st.floats(0.1, 5.0), st.floats(0.1, 5.0), st.floats(0.1, 5.0))


def box(size: tuple[float, ...], colour: Any) -> Visual:
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
    parts = drawn_parts(box(size, BASE_COLOUR))
    assert [part.name for part in parts] == ["foil", "frame"]
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    np.testing.assert_allclose(np.ptp(vertices, axis=0), size)
    np.testing.assert_allclose(vertices.max(axis=0), 0.5 * np.array(size))
    skin = trimesh.Trimesh(*foil(np.array(size)))
    assert skin.is_watertight
    assert 0.85 * np.prod(size) < skin.volume < np.prod(size)  # positive: outwards
    struts = trimesh.Trimesh(*frame(np.array(size), 0.01), process=False)
    assert all(part.volume > 0.0 for part in struts.split(only_watertight=False))
    base, tip, height = size
    frustum = np.pi * height / 3.0 * (base * base + base * tip + tip * tip)
    assert trimesh.Trimesh(*cone(base, tip, height)).volume == pytest.approx(frustum, rel=0.05)


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


def test_what_a_file_draws_is_left_alone() -> None:
    """And what is on a spring and not flat."""
    for colour in ((0.1, 0.2, 0.3, 1.0), None, PANEL_COLOUR):
        assert drawn_parts(box((1.0, 1.0, 1.0), colour)) == []
    sphere = Visual("sphere", (1.0,), np.eye(3), np.zeros(3), colour=BASE_COLOUR)
    assert drawn_parts(sphere) == []


def test_shapes_of_a_urdf_without_a_colour_look_like_a_satellite() -> None:
    """Foil on the base, cells on what is flat, metal on the arm; a material wins."""
    hull, wing = box((1.0, 1.0, 1.2), None), box((2.0, 1.0, 0.02), None)
    red = replace(hull, colour=(1.0, 0.0, 0.0, 1.0))
    robot = replace(find_robot("dual_arm"), visuals=(hull, wing, replace(hull, body=1), red))
    shapes = shown_shapes(robot).shapes
    assert [shape.colour for shape in shapes[:3]] == [BASE_COLOUR, PANEL_COLOUR, LINK_COLOUR]
    assert shapes[3].colour == red.colour
    assert [len(drawn_parts(shape)) for shape in shapes] == [2, 2, 0, 0]


def test_plates_beside_the_base_are_panels_of_their_area(paper_robot: Robot) -> None:
    up, aside = np.array([0.0, 0.0, 1.0]), np.array([0.0, 2.0, 0.0])
    plates = (
        Plate(4.0, up, aside),
        Plate(4.0, -up, aside),  # its other side
        Plate(1.0, up, np.array([0.0, 0.0, 0.63])),  # a face of the base
        Plate(2.0, np.array([0.6, 0.0, 0.8]), -aside, specular=0.7),
    )
    drawn = shown_shapes(replace(paper_robot, plates=plates)).shapes
    first, second = drawn[len(shown_shapes(paper_robot).shapes) :]
    assert first.size == pytest.approx((2.0, 2.0, THICKNESS))
    assert second.size == pytest.approx((np.sqrt(2.0), np.sqrt(2.0), THICKNESS))
    np.testing.assert_allclose(second.rotation[:, 2], [0.6, 0.0, 0.8])
    assert (first.colour, second.colour) == (PANEL_COLOUR, BACK_COLOUR)
    assert list(plate_panels(paper_robot, drawn)) == []


def test_a_large_mesh_keeps_its_form_with_fewer_faces(
    ball: Path, paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read_mesh(str(ball))
    assert len(whole.faces) == 20_480
    assert simplify(whole, 20_480) is whole
    monkeypatch.setattr(shapes, "MOST_FACES", 2_000)
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
    assert (found.shapes[0].mesh, found.shapes[0].colour) == (str(ball), LINK_COLOUR)
    assert {shape.body for shape in found.shapes[1:]} == {3}
    assert all(shape.shape == "cylinder" for shape in found.shapes[1:])
    for remark, file in zip(found.remarks[-2:], (broken, lacking), strict=True):
        assert remark.startswith(f"mesh {file}: cannot be drawn (")
        assert "\n" not in remark


def test_files_that_are_too_large_or_none_are_told_and_the_others_share_the_faces(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking, broken = tmp_path / "lacking.stl", tmp_path / "broken.glb"
    broken.write_bytes(b"glTF" + bytes(30))
    read, remarks = read_meshes((str(lacking), str(broken), str(ball)), 3 * 2_000)
    assert [*read] == [str(ball)]
    assert 500 < len(read[str(ball)].faces) <= 2_000  # its share
    assert remarks[0] == f"mesh {lacking}: cannot be drawn (no such file)"
    assert remarks[1].startswith(f"mesh {broken}: cannot be drawn (")
    monkeypatch.setattr(shapes, "MOST_READ", 20_480)
    assert len(read_mesh(str(ball)).faces) == 20_480
    for name, limit, why in (
        ("MOST_READ", 20_479, r"^20480 faces, at most 20479 are allowed$"),
        ("MOST_BYTES", 1000, "at most 0.001 MB are allowed"),
    ):
        monkeypatch.setattr(shapes, name, limit)
        with pytest.raises(shapes.UnreadableMeshError, match=why):
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


PERIOD = Timebase(10_000_000)
WHEELS = WheelSettings(
    axes=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], max_torque=[2.0], max_momentum=[10.0], rotor_inertia=[0.1]
)


@given(st.floats(0.0, 1e4), st.floats(0.0, 10.0))
def test_a_drawn_wheel_neither_blurs_nor_seems_to_turn_back(speed: float, frame_s: float) -> None:
    slowdown = wheel_slowdown(speed, frame_s)
    drawn = speed / slowdown
    assert drawn <= FASTEST * (1.0 + 1e-12)
    assert drawn * frame_s <= LARGEST_TURN * (1.0 + 1e-12)
    mantissa = slowdown / 10.0 ** np.floor(np.log10(slowdown) + 1e-9)
    assert min(abs(mantissa - step) for step in (1.0, 2.0, 5.0)) < 1e-9
    if slowdown > 1.0:  # and is no slower than necessary
        assert max(drawn / FASTEST, drawn * frame_s / LARGEST_TURN) > 1.0 / 2.5 - 1e-9


def test_a_wheel_at_a_limit_between_two_frames_is_marked() -> None:
    log = FlightLog.allocate(31, RobotNames((), ("w1", "w2")), PERIOD)
    log.wheel_velocities[:], log.wheel_torques[:] = 0.0, 0.0
    log.wheel_torques[13, 0] = -2.0  # the motor's largest
    log.wheel_velocities[25:, 1] = 100.0  # 10 N m s
    log.wheel_velocities[5] = np.nan
    frames = ActuatorFrames.of(
        log, BaseActuatorSettings(wheels=WHEELS), np.array([0.0, 0.1, 0.2, 0.3])
    )
    assert frames.is_saturated[:, 0].tolist() == [False, False, True, False]
    assert frames.is_saturated[:, 1].tolist() == [False, False, False, True]
    assert np.isfinite(frames.angles).all()


def test_wheels_are_at_the_corners_and_those_of_one_axis_behind_one_another(
    paper_robot: Robot,
) -> None:
    axes = assumed_actuators("wheels", paper_robot).wheels.unit_axes
    surface, com = BaseSurface(paper_robot), paper_robot.com[0]
    places = wheel_places(surface, com, axes)
    edge = np.sqrt(6.0 * 200.0 / 750.0) / 2.0
    away = np.linalg.norm(places, axis=1)
    np.testing.assert_allclose(places / away[:, np.newaxis], axes, atol=1e-12)
    assert (away > np.sqrt(3.0) * edge).all()
    assert (away < np.sqrt(3.0) * edge + 0.1).all()
    along_z = np.array([[0, 0, 1.0]] * 2 + [[0, 0, -1.0]])
    first, second, opposite = wheel_places(surface, com, along_z)
    assert edge < first[2] < second[2]
    assert opposite[2] < -edge


def test_no_part_of_a_wheel_is_in_a_long_base() -> None:
    base = Visual("box", (3.0, 1.0, 0.6), position=np.array([0.1, 0.0, 0.0]))
    robot = replace(find_robot("dual_arm"), visuals=(base,))
    surface, turns = BaseSurface(robot), Rotation.random(20, rng=2)
    angles = np.linspace(0.0, 6.0, 12)
    rim = RADIUS * surface.size * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    places = wheel_places(surface, robot.com[0], turns.apply([0.0, 0.0, 1.0]))
    for turn, place in zip(turns, places, strict=True):
        away = np.abs(place + turn.apply(rim) - base.position)
        assert (away > 0.5 * np.array(base.size)).any(axis=1).all()


def test_the_page_turns_the_wheels_and_colours_those_at_a_limit(paper_robot: Robot) -> None:
    """Four wheels with speeds at random, far from their limits but for one torque."""
    log = moving_log(paper_robot, 101, period_ns=PERIOD.period_ns)
    steps = np.random.default_rng(3).uniform(-1.0, 1.0, (101, 4))
    log.base_position[:] = 0.0
    log.wheel_velocities = 100.0 * steps.cumsum(axis=0) / 101
    log.wheel_torques = np.zeros((101, 4))
    log.wheel_torques[40:60, 2] = 4.0
    hardware = assumed_actuators("wheels", paper_robot)
    log.flight = {"base_actuators": hardware.model_dump(), "robot": paper_robot.name}
    page = page_of(paper_robot, one=log)
    scene = Scene(page)
    turned = cumulative_trapezoid(log.wheel_velocities, dx=0.01, axis=0, initial=0.0)
    slowdown = wheel_slowdown(float(np.abs(log.wheel_velocities).max()), 0.04)
    assert f"Wheels turn {slowdown:g} times slower than in flight" in page
    for row in (0, 30, 100):
        poses = scene.poses(0.01 * row + 1e-6)
        base = poses["/one/base_link"].rotation
        for wheel, axis in enumerate(hardware.wheels.unit_axes):
            frame = poses[f"/one/base_link/wheel_{wheel + 1}"].rotation
            rotor = poses[f"/one/base_link/wheel_{wheel + 1}/rotor"].rotation
            np.testing.assert_allclose(rotor[:, 2], base @ axis, atol=1e-3)
            inside = frame.T @ rotor  # about z
            away = np.arctan2(inside[1, 0], inside[0, 0]) - turned[row, wheel] / slowdown
            assert np.angle(np.exp(1j * away)) == pytest.approx(0.0, abs=4.0 * STEP)
    log.flight = {}  # without a description nothing is drawn
    names = Scene(page_of(paper_robot, one=log)).names()
    assert not [name for name in names if "wheel" in name]
    red = tuple(bytes.fromhex(SATURATED[1:]))
    colours = [
        (time, message["name"])
        for time, message in scene.messages
        if message["type"] == "SceneNodeUpdateMessage"
        and tuple(message["updates"].get("color", ())) == red
    ]
    assert [name for _, name in colours] == ["/one/base_link/wheel_3/rotor"]
    assert colours[0][0] == pytest.approx(0.4, abs=0.04)


def test_between_two_frames_the_mean_thrust_counts() -> None:
    """So that a pulse that is shorter than a frame is seen, and impulse is neither lost nor won."""
    log = FlightLog.allocate(101, RobotNames((), (), ("t1", "t2", "t3")), Timebase(1_000_000))
    log.thrusts[:] = np.random.default_rng(1).uniform(size=(101, 3))
    log.thrusts[7] = np.nan
    rows = [0, 10, 35, 100]
    thrusts = ActuatorFrames.of(log, BaseActuatorSettings(), 1e-3 * np.array(rows)).thrusts
    known = np.nan_to_num(log.thrusts)
    np.testing.assert_array_equal(thrusts[0], known[0])
    for k, (start, stop) in enumerate(pairwise(rows)):
        np.testing.assert_allclose(thrusts[k + 1], known[start + 1 : stop + 1].mean(axis=0))


def test_the_plume_is_in_proportion_to_the_thrust_and_against_the_force(paper_robot: Robot) -> None:
    hardware = assumed_actuators("thrusters", paper_robot)
    thrusters = hardware.thrusters
    log = moving_log(paper_robot, 11, period_ns=100_000_000)
    log.thrusts = np.zeros((11, thrusters.count))
    log.thrusts[3:6, 0] = [1.5, 4.5, 3.0]
    log.flight = {"base_actuators": hardware.model_dump(), "robot": paper_robot.name}
    page = page_of(paper_robot, ViewOptions(rate=10.0), one=log)
    assert "the longest 4.5 N" in page
    scene, path = Scene(page), "/one/base_link/thruster_1/plume"
    log.flight = {}
    assert not [n for n in Scene(page_of(paper_robot, one=log)).names() if "thruster" in n]
    lengths = [
        (round(10.0 * time), tuple(message["updates"]["scale"]))
        for time, message in scene.messages
        if message.get("name") == path and "scale" in message.get("updates", {})
    ]
    assert [(row, scale[:2]) for row, scale in lengths] == [(k, (1.0, 1.0)) for k in (3, 4, 5)]
    shares = [scale[2] for _, scale in lengths]
    np.testing.assert_allclose(shares, np.array([1.5, 4.5, 3.0]) / 4.5, atol=0.5 * SHORTEST)
    for time in 0.1 * np.arange(11):
        shown = scene.visible(time + 1e-3)
        assert shown[path] == (0.3 - 1e-9 <= time < 0.6 - 1e-9), time
        assert not shown["/one/base_link/thruster_2/plume"]
    poses = scene.poses(0.3 + 1e-3)
    base = poses["/one/base_link"]
    for number, (place, force) in enumerate(
        zip(thrusters.places, thrusters.unit_directions, strict=True)
    ):
        nozzle = poses[f"/one/base_link/thruster_{number + 1}/nozzle"]
        at = base.position + base.rotation @ (paper_robot.com[0] + place)
        np.testing.assert_allclose(nozzle.position, at, atol=1e-6)
        np.testing.assert_allclose(nozzle.rotation[:, 2], -base.rotation @ force, atol=1e-6)
