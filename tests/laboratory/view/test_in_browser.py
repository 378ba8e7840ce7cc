"""The page in Chromium: it draws, plays, scrubs, and asks the network for nothing."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from space_robot.cli.main import main
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
PATIENCE_MS = 240_000
"""Without a graphics card a frame takes a second where others compute as well."""

pytestmark = pytest.mark.skipif(not CHROMIUM, reason="needs Chromium")


class Seen:
    """A page in the browser, with all that it said and asked for."""

    def __init__(self, browser: Any, file: Path) -> None:
        self.page = browser.new_page(viewport={"width": 900, "height": 500})
        self.page.set_default_timeout(PATIENCE_MS)
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda m: m.type == "error" and self.errors.append(m.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(file.as_uri())
        self.scene = self.page.frame_locator("#scene")
        self.scene.locator("[role=slider]").wait_for(state="attached")
        self.page.wait_for_function("spaceRobot.time() > 0")  # it plays of itself

    def time(self) -> float:
        """The scene's time by the page, s."""
        return float(self.page.evaluate("spaceRobot.time()"))

    def cursors(self) -> list[int]:
        """Where the plots' time stands: the column of each that is brightest from top to bottom."""
        script = """() => [...document.querySelectorAll("#plots canvas")].map((canvas) => {
            const { width, height } = canvas;
            const rgba = canvas.getContext("2d").getImageData(0, 0, width, height).data;
            const lit = new Array(width).fill(0);
            for (let x = 0; x < width; x++) for (let y = 0; y < height; y++) {
                const at = 4 * (y * width + x);
                if (Math.min(...rgba.slice(at, at + 4)) > 220) lit[x]++;
            }
            return lit.indexOf(Math.max(...lit));
        })"""
        found: list[int] = self.page.evaluate(script)
        return found


def shown(folder: Path, browser: Any, **plan: Any) -> Seen:
    """Fly, make the page of the flight, and open it."""
    simulate(Flight(resolve(FlightPlan(**plan))), folder / "bag")
    with pytest.raises(SystemExit):
        main(["view", str(folder / "bag"), "--no-open", "--out", str(folder / "page.html")])
    return Seen(browser, folder / "page.html")


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seen]:
    playwright = pytest.importorskip("playwright.sync_api")
    pytest.importorskip("viser")
    folder = tmp_path_factory.mktemp("page")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield shown(folder, browser, duration=4.0, faults=["drive_scale@2-3:all=0.9"])
        browser.close()


def test_it_plays_and_pauses_with_the_space_bar(seen: Seen) -> None:
    before = seen.time()
    seen.page.wait_for_function(f"spaceRobot.time() != {before}")
    seen.page.keyboard.press("Space")
    seen.page.wait_for_timeout(500)
    paused = seen.time()
    seen.page.wait_for_timeout(500)
    assert seen.time() == paused
    seen.page.keyboard.press("Space")
    seen.page.wait_for_function(f"spaceRobot.time() != {paused}")


def test_scrubbing_the_scene_moves_the_plots(seen: Seen) -> None:
    seen.scene.locator("input").first.fill("1")
    seen.page.wait_for_function("spaceRobot.time() == 1")
    early = seen.cursors()
    seen.scene.locator("input").first.fill("3")
    seen.page.wait_for_function("spaceRobot.time() == 3")
    late = seen.cursors()
    assert len(early) >= 4
    assert all(right > left + 50 for left, right in zip(early, late, strict=True))


def test_a_click_on_a_plot_moves_the_scene(seen: Seen) -> None:
    over = seen.page.locator("#plots .u-over").first
    box = over.bounding_box()
    assert box
    over.click(position={"x": 0.5 * box["width"], "y": 0.5 * box["height"]})
    seen.page.wait_for_function("Math.abs(spaceRobot.time() - 2) < 0.02")
    shown = seen.scene.locator("[role=slider]").get_attribute("aria-valuenow")
    assert float(shown or "nan") == pytest.approx(2.0, abs=0.02)


def test_a_click_on_a_mark_goes_there_and_what_goes_on_is_told(seen: Seen) -> None:
    seen.scene.locator("input").first.fill("0.5")
    seen.page.wait_for_function("spaceRobot.time() == 0.5")
    assert seen.page.locator("#now").inner_text() == "0.50 s"
    seen.page.get_by_text("drive_scale all=0.9").first.click()
    seen.page.wait_for_function("spaceRobot.time() == 2")
    assert seen.page.locator("#now").inner_text() == "2.00 s\ndrive_scale all=0.9"
    assert seen.scene.locator(".flight-mark").count() == 1


def test_the_robot_is_drawn_and_moves(seen: Seen) -> None:
    pictures = []
    for time in ("0.1", "3.9"):
        seen.scene.locator("input").first.fill(time)
        seen.page.wait_for_function(f"spaceRobot.time() == {time}")
        seen.page.wait_for_timeout(1500)
        pictures.append(seen.page.locator("#scene").screenshot(timeout=PATIENCE_MS))
    assert all(len(picture) > 20_000 for picture in pictures)  # an empty one has 5,000 bytes
    assert pictures[0] != pictures[1]


def test_the_choice_of_plots_is_kept_in_the_address(seen: Seen) -> None:
    page, headings = seen.page, seen.page.locator("#plots h2")
    usual = headings.all_inner_texts()
    page.locator("#choice summary").click()
    page.get_by_label("base rate").check()
    page.get_by_label("joints 1-3 error").uncheck()
    chosen = headings.all_inner_texts()
    assert "base rate (rad/s)" in chosen
    assert len(chosen) == len(usual)
    assert not any(text.startswith("joints 1-3") for text in chosen)
    assert page.locator("#plots canvas").count() == len(chosen)
    address = page.url
    assert "base-rate" in address.partition("#plots=")[2].split(",")
    page.get_by_label("base rate").uncheck()
    page.get_by_label("joints 1-3 error").check()
    assert headings.all_inner_texts() == usual
    assert "#" not in page.url
    page.evaluate("location.hash = 'plots=base-rate'")
    page.wait_for_function("document.querySelectorAll('#plots h2').length == 1")
    assert headings.all_inner_texts() == ["base rate (rad/s)"]
    page.evaluate("location.hash = ''")
    page.wait_for_function(f"document.querySelectorAll('#plots h2').length == {len(usual)}")


def assert_whole(seen: Seen) -> None:
    """Nothing was asked of the network, and nothing went wrong."""
    assert [
        url[:80] for url in seen.requests if not url.startswith(("file:", "data:", "blob:"))
    ] == []
    own = seen.page.url.partition("#")[0]
    assert [url for url in seen.requests if url.startswith("file:")] == [own]
    assert seen.errors == []


def test_nothing_was_asked_of_the_network_and_nothing_went_wrong(seen: Seen) -> None:
    assert_whole(seen)


def test_in_orbit_the_earth_is_below(seen: Seen, tmp_path: Path) -> None:
    """By day it is blue; above it is the sky, which is as dark as the page."""
    image = pytest.importorskip("PIL.Image")
    orbit = shown(tmp_path, seen.page.context.browser, duration=0.5, orbit="iss")
    orbit.page.keyboard.press("Space")
    orbit.page.wait_for_timeout(1500)
    data = orbit.page.locator("#scene").screenshot(timeout=PATIENCE_MS)
    picture = np.asarray(image.open(io.BytesIO(data)).convert("RGB"), float)
    height, width, _ = picture.shape
    part = slice(int(0.80 * height), int(0.86 * height))  # above the time line
    red, _, blue = np.median(picture[part, width // 2 :], axis=(0, 1))
    assert blue > 100.0
    assert blue > 2.0 * red
    sky = np.median(picture[: height // 8], axis=(0, 1))
    assert sky.max() < 40.0
    assert orbit.page.locator("#arrows").inner_text().split("\n") == [
        "nadir",
        "orbital velocity",
        "Sun",
    ]
    assert_whole(orbit)
    orbit.page.close()
