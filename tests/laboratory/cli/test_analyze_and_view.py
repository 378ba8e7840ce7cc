"""``space-robot analyze`` and ``view`` on bags of real flights: reports, files, pages."""

from __future__ import annotations

import html
import json
import re
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command import Run
from paths import DATA
from PIL import Image
from scene_pages import Scene, plot_data

from space_robot.analysis import analyze as report_of
from space_robot.analysis import excerpt
from space_robot.analysis.described import flown_robot
from space_robot.cli.main import main
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot.view.flights import shown_robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.installation import install_command

LARGEST = 2e6
"""Bytes of a page of a short flight."""


@pytest.fixture
def view(space_robot: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    monkeypatch.chdir(tmp_path)
    return partial(space_robot, "view")


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Of two laws."""
    folder = tmp_path_factory.mktemp("bags")
    simulate(Flight(resolve(Scenario(duration=0.3))), folder / "first")
    simulate(Flight(resolve(Scenario(controller="ctc", duration=0.3))), folder / "second")
    return folder / "first", folder / "second"


@pytest.fixture(scope="module")
def page_file(bags: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the first flight."""
    out = tmp_path_factory.mktemp("page") / "first.html"
    with pytest.raises(SystemExit) as ended:
        main(["view", str(bags[0]), "--no-open", "--out", str(out)])
    assert not ended.value.code
    return out


def test_a_page_is_small_and_needs_no_other_file(page_file: Path) -> None:
    page = page_file.read_text("utf-8")
    assert page_file.stat().st_size < LARGEST
    assert Scene(page).duration == pytest.approx(0.3 - 5e-4)
    fetched = re.findall(r"""\b(?:src|href|data|srcset)=["']([^"']*)""", html.unescape(page))
    assert [address for address in fetched if not address.startswith(("data:", "#"))] == []
    own = re.sub(r'srcdoc="[^"]*"', "", page)
    assert not re.search(
        r"https?:(?!//(?:www\.w3\.org|github\.com/leeoniya))|import\(|fetch\(|url\(", own
    )


def test_several_are_drawn_over_one_another_with_a_legend(
    view: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    out = tmp_path / "new" / "both.html"
    result = view(*bags, "--no-open", "--out", out, "--title", "law <against> law", "--light")
    assert result.code == 0, result.err
    page = out.read_text("utf-8")
    assert "law &lt;against&gt; law" in page
    assert "<b>first</b> tde_stc, paper, case 1" in page
    assert "<b>second</b> ctc, paper, case 1" in page
    assert [s["label"] for s in plot_data(page)["plots"][0]["series"]] == ["first", "second"]
    poses = Scene(page).poses(0.0)
    np.testing.assert_array_equal(poses["/second"].position, np.zeros(3))
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
    assert "wrote second_view.html (" in result.err
    assert opened.read_text().strip() == (tmp_path / "second_view.html").as_uri()


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


def flown_arm(tmp_path: Path) -> Path:
    """A flight of the arm of a URDF with a spring in its slide, into `flown`."""
    urdf = tmp_path / "urdf" / "arm.urdf"
    urdf.parent.mkdir()
    urdf.write_text((DATA / "arm.urdf").read_text().replace("package://arm/", ""))
    trimesh.creation.cone(0.1, 0.4).export(urdf.parent / "fore.stl")
    robot = urdf.with_name("sprung.yaml")
    spring = {"slide": {"stiffness": 50.0, "damping": 1.0}}
    robot.write_text(json.dumps({"robot": {"urdf": "arm.urdf", "passive": spring}}))
    gains = {"k_p": [1e4], "k_d": [200.0]}
    segments = [{"joints_deg": [5.0], "duration": 4.0}]
    mission = {"start": {"joints_deg": [0.0]}, "segments": segments}
    plan = {"robot": str(robot), "mission": mission, "gains": gains, "controller": "ctc"}
    simulate(Flight(resolve(Scenario(**plan, duration=0.1))), tmp_path / "flown")
    return urdf


def drawn(page: Path) -> set[str]:
    """The kinds of shapes in a page's scene."""
    messages = Scene(page.read_text("utf-8")).messages
    return {str(m["type"]) for _, m in messages if m["type"] in SHAPES}


SHAPES = {"MeshMessage", "IcosphereMessage", "BoxMessage", "CylinderMessage"}


def test_a_bag_has_the_shapes_of_its_urdf(view: Run, tmp_path: Path) -> None:
    """Meshes are files, which only a trusted bag or `--robot` may name; a URDF has no springs."""
    urdf = flown_arm(tmp_path)
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
    assert shown_robot(log, str(urdf)).springs == flown_robot(log).springs != ()


def test_a_live_view_without_ros_ends_with_one_line(
    space_robot: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    ended = space_robot("view", "--live", "--no-open")
    assert ended.code == 1
    assert ended.err.startswith("space-robot: error: rclpy cannot be imported")
    assert install_command("ros") in ended.err


@pytest.fixture
def analyze(space_robot: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setenv("COLUMNS", "100")
    return partial(space_robot, "analyze")


def test_json_of_one_is_an_object_and_of_several_a_list(
    analyze: Run, bags: tuple[Path, Path]
) -> None:
    own = [report_of(read_flight(bag)) for bag in bags]
    assert json.loads(analyze(bags[0], "--json").out) == own[0]
    assert json.loads(analyze(*bags, "--json").out) == own
    part = json.loads(analyze(bags[0], "--from", 0.1, "--to", 0.2, "--json").out)
    assert part == report_of(excerpt(read_flight(bags[0]), 0.1, 0.2))


def test_bags_of_one_name_are_told_apart(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    paths = [shutil.copytree(bags[0], tmp_path / day / "flight") for day in ("monday", "tuesday")]
    result = analyze(*paths, "--csv", tmp_path / "csv")
    names = sorted(path.name for path in (tmp_path / "csv").iterdir())
    assert names == ["monday_flight.csv", "tuesday_flight.csv"]
    assert result.code == 0


def test_pictures_are_pngs_and_renewed(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    """Those of one flight are replaced by those of two."""
    names = ("base_pointing", "desired_joints", "control_results", "chatter", "pointing")
    folder = tmp_path / "figures"
    folder.mkdir()
    for name in names:
        (folder / f"{name}.png").write_text("older")
    assert analyze(*bags, "--plot", folder).code == 0
    assert {path.stem for path in folder.glob("*.png")} == set(names)
    for path in folder.glob("*.png"):
        with Image.open(path) as image:
            assert image.width > 1000
            assert len(image.getcolors(10**7)) > 50


def test_a_paper_has_pdfs_of_its_width_and_the_reports_numbers(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    words = ("--plot", tmp_path, "--width", "single", "--format", "pdf", "--latex")
    result = analyze(*bags, *words, tmp_path / "results.tex", "--json")
    assert result.code == 0
    assert {path.suffix for path in tmp_path.iterdir()} == {".pdf", ".tex"}
    content = (tmp_path / "control_results.pdf").read_bytes()
    (points,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+)", content)
    assert float(points) == pytest.approx(88.9 / 25.4 * 72.0, abs=0.01)
    rows = re.findall(
        r"^base torque & .*", (tmp_path / "results.tex").read_text("utf-8"), re.MULTILINE
    )
    shown = [float(number) for number in re.findall(r"\$([\d.]+)\$", rows[0])]
    expected = [report["metrics"]["base_torque.rms"] for report in json.loads(result.out)]
    assert shown == pytest.approx(expected, rel=5e-3)


def test_the_shortest_excerpts_have_what_they_can_have(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path
) -> None:
    words = ("--from", 0.1, "--to", 0.1005, "--html", tmp_path / "page.html")
    result = analyze(*bags, *words, "--parquet", tmp_path)
    assert result.code == 0
    assert "no settling" in result.out


def test_a_bag_that_nobody_finished_is_analysed_and_said_so(
    analyze: Run, bags: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(bags[0], tmp_path / "cut")
    (tmp_path / "cut" / "metadata.yaml").unlink()
    file = next((tmp_path / "cut").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-100])
    report = json.loads(analyze(tmp_path / "cut", "--json").out)
    told = [text for text in (report["unfinished"], *report["damage"]) if text]
    assert told
    monkeypatch.setattr("space_robot.analysis.figures.figure_set.FigureSet.save", lambda *_: [])
    result = analyze(tmp_path / "cut", "--html", tmp_path / "cut.html")
    assert result.code == 0
    for text in told:
        assert text in " ".join(result.out.split())
    assert "not whole" in (tmp_path / "cut.html").read_text("utf-8")


def test_a_robot_that_is_not_here_costs_only_its_figures(analyze: Run, tmp_path: Path) -> None:
    flight = Flight(resolve(Scenario(duration=0.05)))
    log = simulate(flight)
    log.scenario = None
    log.flight.pop("robot_file", None)
    log.flight["robot"] = "elsewhere"
    report = report_of(log)
    assert "boresight.rms" not in report["metrics"]
    assert "unknown robot 'elsewhere'" in report["unavailable"]["end_effector"]
    assert report["metrics"]["attitude.rms"] > 0.0
    log.flight["robot"] = "seven_joint"
    assert "has the joints" in report_of(log)["unavailable"]["end_effector"]


def test_band_and_window_are_those_of_the_options(analyze: Run, bags: tuple[Path, Path]) -> None:
    result = analyze(bags[0], "--json", "--band", "1e-9", "--window", "0.01")
    report = json.loads(result.out)
    base, metrics = report["pointing"], report["metrics"]
    assert (base["band_deg"], base["window_s"]) == (1e-9, 0.01)
    assert metrics["half_cone.within_band"] < 1.0
    assert 0.0 < metrics["half_cone.jitter_rms"] < metrics["half_cone.max"]
    refused = analyze(bags[0], "--band", "0")
    assert refused.code == 2
