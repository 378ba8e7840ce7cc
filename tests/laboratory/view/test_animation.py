"""Animated pictures: their frames are the scene at their times, and the file moves for ever."""

from __future__ import annotations

import io
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from flights import space_robot_here

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.view import animation
from space_robot.view.browser import NAMES

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("viser")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight in which the arm is seen to move."""
    folder = tmp_path_factory.mktemp("flights") / "one"
    simulate(Flight(resolve(FlightPlan(duration=3.0))), folder)
    return folder


@pytest.mark.parametrize("ending", animation.FORMATS)
def test_an_endless_animation_of_all_frames(ending: str) -> None:
    colours = [(255, 0, 0), (0, 255, 0), (0, 0, 255)]
    frames = [Image.new("RGB", (40, 30), colour) for colour in colours]
    picture = Image.open(io.BytesIO(animation.encoded(frames, Path(f"a{ending}"))))
    assert picture.n_frames == len(frames)
    assert picture.info["loop"] == 0
    for k, colour in enumerate(colours):
        picture.seek(k)
        assert np.abs(np.array(picture.convert("RGB"))[15, 20] - np.array(colour)).max() < 12
        assert picture.info["duration"] == pytest.approx(1000 / animation.RATE_HZ)


@pytest.mark.skipif(not any(map(shutil.which, NAMES)), reason="needs Chromium")
def test_the_robot_moves_and_the_curves_grow(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "LENGTH_S", 3 / animation.RATE_HZ)
    file = tmp_path / "one.png"
    done = space_robot_here("view", str(bag), "--out", str(file), "--no-open")
    assert done.returncode == 0, done.stderr
    frames = []
    with Image.open(file) as picture:
        assert picture.size == animation.SIZE
        for k in range(3):
            picture.seek(k)
            frames.append(np.array(picture.convert("RGB"), float))
    width = animation.SIZE[0]
    for before, after in pairwise(frames):
        changed = np.abs(after - before).max(axis=2) > 40
        assert changed[:, : width // 2].sum() > 100  # the arm
        assert changed[:, 2 * width // 3 :].sum() > 100  # the curves
    assert (frames[0][:, : width // 2].max(axis=2) > 150).sum() > 3_000  # a robot in the light


def test_several_bags_are_no_picture(bag: Path, tmp_path: Path) -> None:
    other = tmp_path / "two"
    shutil.copytree(bag, other)
    file = tmp_path / "both.webp"
    done = space_robot_here("view", str(bag), str(other), "--out", str(file), "--no-open")
    assert done.returncode == 2
    assert "an animated picture shows one flight, got 2 bags" in done.stderr
    assert not file.exists()


def test_without_a_browser(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    done = space_robot_here("view", str(bag), "--out", str(tmp_path / "one.gif"), "--no-open")
    assert done.returncode == 2
    assert "no browser is installed: one of chromium" in done.stderr
