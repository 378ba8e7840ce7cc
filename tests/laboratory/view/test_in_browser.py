"""The page in Chromium: it draws, plays, scrubs, and asks the network for nothing."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from paths import DOCS
from PIL import Image
from scene_pages import page_of, plot_data

from space_robot import Scenario
from space_robot_model.robot import Robot

CURSORS = """[...document.querySelectorAll("#plots canvas")].map((canvas) => {
    const { width, height } = canvas;
    const rgba = canvas.getContext("2d").getImageData(0, 0, width, height).data;
    const lit = new Array(width).fill(0);
    for (let x = 0; x < width; x++) for (let y = 0; y < height; y++) {
        const at = 4 * (y * width + x);
        if (Math.min(...rgba.slice(at, at + 4)) > 220) lit[x]++;
    }
    return lit.indexOf(Math.max(...lit));
})"""
"""Where the plots' time stands: the column of each that is brightest from top to bottom."""
STANDS = """(async () => {
    const before = spaceRobot.time();
    for (let k = 0; k < 2; k++) await new Promise(requestAnimationFrame);
    return spaceRobot.time() === before;
})()"""
SCENE = 'document.getElementById("scene").contentDocument'
LEGENDS = """[...document.querySelectorAll("#plots .u-legend")].map(
    (legend) => [...legend.querySelectorAll(".u-series")].slice(1).map(
        (row) => [".u-label", ".u-value"].map((name) => row.querySelector(name).innerText)))"""
HEADINGS = '[...document.querySelectorAll("#plots h2")].map((h) => h.innerText)'


@pytest.fixture(scope="module")
def page(paper_robot: Robot) -> str:
    """The page of a flight in orbit, by day, with a fault."""
    log = Scenario(duration=4.0, orbit="iss", faults=["drive_scale@2-3:all=0.9"]).fly().log
    return page_of(paper_robot, one=log)


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory, page: str) -> Iterator[Any]:
    """The page in a browser."""
    sys.path.insert(0, str(DOCS))
    from devtools import Browser, chromium

    if chromium() is None:
        pytest.skip("needs Chromium")
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(page, "utf-8")
    with Browser() as browser:
        tab = browser.tab(480, 400)
        tab.open(file.as_uri())
        tab.wait("window.spaceRobot && spaceRobot.time() > 0")  # it plays of itself
        yield tab
        assert not [url for url in tab.requests if not url.startswith(("file:", "data:", "blob:"))]
        assert [url for url in tab.requests if url.startswith("file:")] == [file.as_uri()]
        assert not [text for text in tab.messages if text.startswith(("error", "exception"))]


def seek(tab: Any, seconds: float) -> None:
    tab.value(f"spaceRobot.seek({seconds})")
    tab.wait(f"Math.abs(spaceRobot.time() - {seconds}) < 0.02")


def test_it_plays_and_pauses_with_the_space_bar(tab: Any) -> None:
    space = 'dispatchEvent(new KeyboardEvent("keydown", { code: "Space" }))'
    for _ in range(2):
        tab.wait(f"spaceRobot.time() != {tab.value('spaceRobot.time()')}")
        tab.value(space)
        tab.wait(STANDS)
        tab.value(space)
    tab.value(space)
    tab.wait(STANDS)


def test_the_scenes_time_moves_the_plots_and_a_click_on_a_plot_the_scene(tab: Any) -> None:
    seek(tab, 1.0)
    early = tab.value(CURSORS)
    seek(tab, 3.0)
    late = tab.value(CURSORS)
    assert len(early) >= 4
    assert all(right > left + 50 for left, right in zip(early, late, strict=True))
    tab.value('document.querySelector("#plots .u-over").scrollIntoView()')
    x, y = tab.value(
        "(({ x, y, width, height }) => [x + width / 2, y + height / 2])"
        '(document.querySelector("#plots .u-over").getBoundingClientRect())'
    )
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        tab.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
    tab.wait("Math.abs(spaceRobot.time() - 2) < 0.02")


def test_legends_have_the_values_at_the_scenes_time(tab: Any, page: str) -> None:
    """With units, and nothing of them is cut."""
    tab.ask("Input.dispatchMouseEvent", type="mouseMoved", x=1, y=1)  # off the plots
    data = plot_data(page)
    shown = (plot for plot in data["plots"] if plot["shown"])
    seek(tab, 3.0)
    row = int(np.searchsorted(data["time"], tab.value("spaceRobot.time()"), "right")) - 1
    for plot, texts in zip(shown, tab.value(LEGENDS), strict=True):
        for series, text in zip(plot["series"], texts, strict=True):
            number, unit = text[1].split(" ", 1)
            assert (text[0], unit) == (series["label"], plot["unit"])
            assert float(number) == pytest.approx(series["values"][row], rel=0.051)
    cut = "(e) => e.scrollWidth > e.clientWidth + 1"
    assert not tab.value(f'[...document.querySelectorAll(".u-series > *")].some({cut})')


def test_a_click_on_a_mark_goes_there_and_what_goes_on_is_told(tab: Any) -> None:
    now = 'document.getElementById("now").innerText'
    seek(tab, 0.5)
    assert tab.value(now) == "0.50 s"
    tab.value('document.querySelector("#marks button").click()')
    tab.wait("spaceRobot.time() == 2")
    assert tab.value(now) == "2.00 s\ndrive_scale all=0.9"
    assert tab.value(f'{SCENE}.querySelectorAll(".flight-mark").length') == 1


def test_the_choice_of_plots_is_kept_in_the_address(tab: Any) -> None:
    usual = tab.value(HEADINGS)
    tab.value('document.querySelector("#choice summary").click()')
    for title in ("base rate", "joints 1-3 error"):
        label = f'(label) => label.innerText.trim() === "{title}"'
        labels = f'[...document.querySelectorAll("#choice label")].find({label})'
        tab.value(f'{labels}.querySelector("input").click()')
    chosen = tab.value(HEADINGS)
    assert "base rate (rad/s)" in chosen
    assert len(chosen) == len(usual)
    assert not any(text.startswith("joints 1-3") for text in chosen)
    assert "base-rate" in tab.value("location.hash").partition("#plots=")[2].split(",")
    tab.value("location.hash = 'plots=base-rate'")
    tab.wait(f"{HEADINGS}.length == 1")
    assert tab.value(HEADINGS) == ["base rate (rad/s)"]
    tab.value("location.hash = ''")
    tab.wait(f"{HEADINGS}.length == {len(usual)}")


def test_the_robot_moves_above_the_earth(tab: Any) -> None:
    """By day the Earth is blue; above it is the sky, which is as dark as the page."""
    tab.value("scrollTo(0, 0)")
    buttons = f'{SCENE}.querySelectorAll(".mantine-CloseButton-root")'
    tab.value(f"{buttons}.forEach((button) => button.click())")  # that there is no graphics card
    tab.wait(f"{buttons}.length === 0")
    height = tab.value('document.getElementById("scene").getBoundingClientRect().height')
    pictures = []
    for seconds in (0.1, 3.9):
        seek(tab, seconds)
        picture = Image.open(io.BytesIO(tab.picture())).convert("RGB")
        pictures.append(np.asarray(picture, float)[: int(0.7 * height)])
    assert (np.abs(pictures[1] - pictures[0]).max(axis=2) > 40.0)[40:].sum() > 100
    red, _, blue = pictures[1].transpose(2, 0, 1)
    is_earth = (blue > 100.0) & (blue > 2.0 * red)
    assert is_earth[-10:].mean() > 0.2
    assert np.median(pictures[1][:40]) < 40.0
    arrows = tab.value('document.getElementById("arrows").innerText')
    assert arrows.split("\n") == ["nadir", "orbital velocity", "Sun"]
