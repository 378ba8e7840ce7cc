"""The command `view`: a page complete in itself, small, and opened; errors in one line."""

from __future__ import annotations

import html
import json
import re
import sys
from functools import partial
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command import Run
from paths import DATA
from scene_pages import Scene, plot_data

from space_robot.analysis.described import robot_of
from space_robot.analysis.metrics import tracking_error
from space_robot.cli.main import main
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.view.flights import shown_robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.extras import install_command

LARGEST = 3e6
"""Bytes of a page of a flight of a second."""


@pytest.fixture
def view(space_robot: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    monkeypatch.chdir(tmp_path)
    return partial(space_robot, "view")


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A flight of a second, and a short one."""
    folder = tmp_path_factory.mktemp("bags")
    simulate(Flight(resolve(FlightPlan(duration=1.0))), folder / "whole")
    simulate(Flight(resolve(FlightPlan(controller="ctc", duration=0.3))), folder / "short")
    return folder / "whole", folder / "short"


@pytest.fixture(scope="module")
def whole(bags: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the flight of a second."""
    out = tmp_path_factory.mktemp("page") / "whole.html"
    with pytest.raises(SystemExit) as ended:
        main(["view", str(bags[0]), "--no-open", "--out", str(out)])
    assert not ended.value.code
    return out


class References(HTMLParser):
    """What a browser would fetch for a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take the addresses of a tag; a page in a page has its own."""
        for name, value in attrs:
            if name == "srcdoc":
                self.found += References(value or "").found
            elif name in ("src", "href", "data", "action", "poster", "srcset"):
                self.found.append(value or "")


def test_a_page_is_small_and_needs_no_other_file(whole: Path) -> None:
    page = whole.read_text("utf-8")
    assert whole.stat().st_size < LARGEST
    assert Scene(page).duration == pytest.approx(1.0 - 5e-4)
    assert [ref for ref in References(page).found if not ref.startswith(("data:", "#"))] == []
    own = re.sub(r'srcdoc="[^"]*"', "", page)
    assert not re.search(
        r"https?:(?!//(?:www\.w3\.org|github\.com/leeoniya))|import\(|fetch\(|url\(", own
    )


def test_the_plots_are_the_bags_errors(whole: Path, bags: tuple[Path, Path]) -> None:
    plots = plot_data(whole.read_text("utf-8"))["plots"]
    log = read_flight(bags[0])
    by_title = {plot["title"]: plot for plot in plots}
    assert list(by_title)[:3] == ["attitude error", "joints 1-3 error", "joints 4-6 error"]
    error = tracking_error(log)
    for axis, series in enumerate(by_title["joints 4-6 error"]["series"]):
        assert series["label"] == f"joint{axis + 4}"
        known = [value for value in series["values"] if value is not None]
        assert max(known) == pytest.approx(np.max(error[:, axis + 6]), rel=1e-3)
        assert min(known) == pytest.approx(np.min(error[:, axis + 6]), rel=1e-3)
    torque = by_title["base torque"]["series"][2]["values"]
    assert max(torque) == pytest.approx(np.max(log.applied_torque[:, 2]), rel=1e-3)


def test_several_are_drawn_over_one_another_with_a_legend(
    view: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    out = tmp_path / "new" / "both.html"
    result = view(*bags, "--no-open", "--out", out, "--title", "law <against> law", "--light")
    assert result.code == 0, result.err
    page = out.read_text("utf-8")
    assert "law &lt;against&gt; law" in page
    assert "<b>whole</b> tde_stc, paper, case 1" in page
    assert "<b>short</b> ctc, paper, case 1" in page
    assert [s["label"] for s in plot_data(page)["plots"][0]["series"]] == ["whole", "short"]
    poses = Scene(page).poses(0.0)
    np.testing.assert_array_equal(poses["/short"].position, np.zeros(3))
    assert "darkMode:false" in html.unescape(page)


def test_the_page_is_opened_in_the_users_browser(
    view: Run, bags: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser, opened = tmp_path / "browser", tmp_path / "opened"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    monkeypatch.setattr("webbrowser._tryorder", None)  # it reads BROWSER once
    result = view(bags[1])
    assert (result.code, result.out) == (0, "")
    assert "wrote short_view.html (" in result.err
    assert opened.read_text().strip() == (tmp_path / "short_view.html").as_uri()


def test_the_plots_of_the_chosen_kinds_are_shown_first(
    view: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    result = view(bags[1], "--no-open", "--out", "p.html", "--plots", "rates, attitude,wheels")
    assert result.code == 0, result.err
    page = (tmp_path / "p.html").read_text("utf-8")
    assert "Not in the recording: wheels." in page
    plots = plot_data(page)["plots"]
    assert [plot["title"] for plot in plots if plot["shown"]] == ["attitude error", "base rate"]
    assert {"torque 1-3", "joint positions", "angular momentum"} <= {p["title"] for p in plots}


def test_without_viser_one_line_says_what_to_install(
    view: Run, bags: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("space_robot.view.stage.find_spec", lambda name: None)
    result = view(bags[1], "--no-open")
    assert result.code == 2
    what = f"view needs viser: {install_command('view')} (see: space-robot help install)"
    assert result.err == f"space-robot: error: {what}\n"


def flown_arm(tmp_path: Path, passive: bool) -> Path:
    """A flight of the arm of a URDF, with a spring or a motor in its slide, into `flown`."""
    urdf = tmp_path / "urdf" / "arm.urdf"
    urdf.parent.mkdir()
    urdf.write_text((DATA / "arm.urdf").read_text().replace("package://arm/", ""))
    trimesh.creation.cone(0.1, 0.4).export(urdf.parent / "fore.stl")
    robot = urdf.with_name("sprung.yaml")
    spring = {"slide": {"stiffness": 50.0, "damping": 1.0}} if passive else {}
    robot.write_text(json.dumps({"robot": {"urdf": "arm.urdf", "passive": spring}}))
    gains, mission = urdf.with_name("ctc.yaml"), urdf.with_name("mission.yaml")
    gains.write_text("controller_node: {ros__parameters: {ctc: {k_p: [1e4], k_d: [200.0]}}}\n")
    points, start = ("0.0, 5.0", "0.0") if passive else ("0.0, 0.0, 5.0, 0.1", "0.0, 0.0")
    mission.write_text(
        "mission_node: {ros__parameters: {waypoint_times: [0.0, 1.0],"
        f" waypoints_deg: [{points}]}}}}\n"
        f"plant_node: {{ros__parameters: {{initial_joints_deg: [{start}]}}}}\n"
    )
    files = {"robot": str(robot), "mission": str(mission), "gains": str(gains)}
    plan = FlightPlan(**files, controller="ctc", duration=0.1)
    simulate(Flight(resolve(plan)), tmp_path / "flown")
    return urdf


def drawn(page: Path) -> set[str]:
    """The kinds of shapes in a page's scene."""
    messages = Scene(page.read_text("utf-8")).messages
    return {str(m["type"]) for _, m in messages if m["type"] in SHAPES}


SHAPES = {"MeshMessage", "IcosphereMessage", "BoxMessage", "CylinderMessage"}


@pytest.mark.parametrize("passive", [False, True])
def test_a_bag_has_the_shapes_of_its_urdf(view: Run, tmp_path: Path, passive: bool) -> None:
    """Meshes are files, which only a trusted bag or `--robot` may name; a URDF has no springs."""
    urdf = flown_arm(tmp_path, passive)
    hint = "flown: mesh files that the bag names are drawn with --trust\n"
    own = view("flown", "--no-open", "--out", "own.html")
    assert own.code == 0, own.err
    assert hint in own.err
    assert drawn(tmp_path / "own.html") == SHAPES - {"MeshMessage"}
    for name, more in (("trusted", ["--trust"]), ("named", ["--robot", str(urdf)])):
        shown = view("flown", "--no-open", "--out", f"{name}.html", *more)
        assert shown.code == 0, shown.err
        assert hint not in shown.err
        assert drawn(tmp_path / f"{name}.html") == SHAPES
    log = read_flight(tmp_path / "flown")
    assert shown_robot(log, str(urdf)).springs == robot_of(log).springs


def test_a_live_view_without_ros_ends_with_one_line(
    space_robot: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    ended = space_robot("view", "--live", "--no-open")
    assert ended.code == 1
    assert ended.err.startswith("space-robot: error: rclpy cannot be imported")
    assert install_command("ros") in ended.err
