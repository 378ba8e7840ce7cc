"""Events of a mission as texts and files: what they mean, and what is refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import CONFIG
from random_robots import random_inertia, random_robot

from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.events import Capture, Release, named_targets, parse_events
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target, TargetPlace

BODY: dict[str, Any] = {"mass": 2.0, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}
NUMBER = st.floats(-1e3, 1e3)
THREE = st.lists(NUMBER, min_size=3, max_size=3)


def write(folder: Path, **changed: Any) -> Path:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump({"target": {**BODY, **changed}}), "utf-8")
    return path


@given(
    st.floats(0.0, 1e6),
    st.integers(0, 2**32 - 1),
    THREE,
    THREE,
    THREE,
    st.sampled_from(["tool", "inertial"]),
)
def test_the_text_of_a_capture_has_all_its_numbers(
    time: float, seed: int, place: list[float], v: list[float], w: list[float], to: str
) -> None:
    motion = {"relative_to": to, "velocity": v, "angular_velocity": w}
    inertia = random_inertia(np.random.default_rng(seed), 1.0)
    content = {"mass": 3.0, "inertia": inertia, "place": {"position": place}, "motion": motion}
    event = Capture(time, Target.from_dict({"target": content}))
    assert parse_events([str(event)]) == [event]
    assert not named_targets([str(event)])


@given(st.floats(0.0, 1e6), st.floats(0.0, 100.0))
def test_the_text_of_a_release_has_its_numbers(time: float, speed: float) -> None:
    held = Capture(0.0, Target.from_dict({"target": BODY}))
    event = Release(time + 1.0, speed)
    assert parse_events([str(event), "", str(held)]) == [held, event]


def test_a_target_is_a_shipped_one_or_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path begins where we are or, if nothing is there, at the mission's file."""
    path, elsewhere = write(tmp_path), tmp_path / "elsewhere"
    elsewhere.mkdir()
    texts = [f"capture@1:{path}", "capture@1:mine.yaml"]
    monkeypatch.chdir(tmp_path)
    found = [parse_events([text])[0] for text in texts]
    monkeypatch.chdir(elsewhere)
    found.append(parse_events([texts[1]], tmp_path)[0])
    assert found == [Capture(1.0, Target(**BODY))] * 3
    assert named_targets([*texts, "release@2"]) == [str(path), "mine.yaml"]
    for file in sorted((CONFIG / "targets").glob("*.yaml")):
        (event,) = parse_events([f"capture@1:{file.stem}"])
        assert isinstance(event, Capture)
        assert event.target == Target.from_yaml(file)
        assert event.label == f"capture@1:{file.stem}"


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["grab@1:small_satellite"], "choose one of capture, release"),
        (["capture"], r"capture@T:TARGET or release@T\[:SPEED\] expected"),
        (["capture@-1:small_satellite"], "expected, as capture@10:small_satellite"),
        (["capture@1e999:small_satellite"], "T must be from 0 to "),
        (["capture@1"], "a target is needed"),
        (["capture@1:moon"], "choose one of neighbouring_satellite, small_satellite, tumbling"),
        (["capture@1:no/such.yaml"], "no/such.yaml"),
        (["capture@1:{mass: -1}"], "mass"),
        (["capture@1:{mass: 1"], "capture@1:{mass: 1"),
        (["capture@1:{mass: 1, inertia: [1, 1, 9, 0, 0, 0]}"], "inertia"),
        (["release@1"], "nothing is held then"),
        (["capture@1:small_satellite", "release@2:fast"], "SPEED must be a number from 0 to 100"),
        (["capture@1:small_satellite", "release@2:-1"], "SPEED must be a number from 0 to 100"),
        (["capture@2:small_satellite", "capture@3:small_satellite"], "must be released first"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(texts: list[str], said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        parse_events(texts)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"mass": 0.0}, "target.mass"),
        ({"mass": float("nan")}, "target.mass"),
        ({"inertia": [1.0, 1.0, 9.0, 0.0, 0.0, 0.0]}, "target.inertia"),
        ({"weight": 1.0}, "weight"),
        ({"place": {"position": [1.0]}}, "target.place.position"),
        ({"place": {"quaternion": [0.0, 0.0, 0.0, 0.0]}}, "target.place.quaternion"),
        ({"motion": {"relative_to": "moon"}}, "target.motion.relative_to"),
        ({"motion": {"velocity": [1.0, 2.0, 3e9]}}, "target.motion.velocity"),
    ],
)
def test_a_wrong_file_is_refused_with_its_key(
    tmp_path: Path, changed: dict[str, Any], said: str
) -> None:
    path = write(tmp_path, **changed)
    with pytest.raises(InputError) as caught:
        parse_events([f"capture@1:{path}"])
    text = str(caught.value)
    assert "\n" not in text
    assert said in text
    assert "mine.yaml" in text


def test_a_tool_that_the_robot_has_not_is_refused() -> None:
    robot = random_robot(np.random.default_rng(1), 2)
    event = Capture(1.0, Target.from_dict({"target": {**BODY, "tool": "left"}}))
    with pytest.raises(InputError, match="unknown tool 'left' of robot 'random2' for target"):
        Captures([event], robot, 5e-4, OrbitSettings())


@settings(max_examples=300)
@given(
    st.text(max_size=30)
    | st.from_regex(r"(capture|release)@[0-9.e+-]{0,6}(:.{0,20})?", fullmatch=True)
)
def test_any_text_is_read_or_refused(text: str) -> None:
    said = ""
    try:
        parse_events([text])
    except InputError as error:
        said = str(error)
    assert "\n" not in said


@pytest.mark.parametrize("text", ["capture@1:{mass: x}", "capture@1:{name: a", "release@1:fast"])
def test_wrong_numbers_in_the_text_of_an_event_are_refused_by_the_settings(text: str) -> None:
    with pytest.raises(ValueError, match="event"):
        EnvironmentSettings(events=[text])


def test_by_default_a_target_is_held_as_it_stands_at_the_tools_origin() -> None:
    place = TargetPlace()
    assert place.quaternion == [1.0, 0.0, 0.0, 0.0]
    assert place.position == [0.0, 0.0, 0.0]
