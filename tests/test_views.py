"""The layouts of config/views: what they show is in a bag of ours, in words that the tools know."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from flights import simulated
from paths import CONFIG
from rosbags.highlevel import AnyReader

from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.wire.messages import TELEMETRY_ROWS

VIEWS = CONFIG / "views"
SHOWN = {topic.full_name: topic for topic in (topics.ROBOT_DESCRIPTION, topics.MARKERS)}


def test_there_are_three_layouts_and_none_names_a_file_of_a_machine() -> None:
    files = [path for path in VIEWS.iterdir() if path.is_file()]
    assert {path.name for path in files} == {"fly.rviz", "foxglove.json", "plotjuggler.xml"}
    for path in files:
        assert not re.search(r"/(home|tmp|root|work)/", path.read_text("utf-8")), path


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The last message of each topic in a bag."""
    bag = tmp_path_factory.mktemp("views") / "bag"
    simulated(bag, duration=0.05)
    with AnyReader([bag]) as reader:
        return {
            connection.topic: reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }


def value_of(path: str, seen: dict[str, Any]) -> Any:
    """What Foxglove's message path says of the messages: ``/topic.field[0].field``."""
    topic, *fields = path.split(".")
    found = seen[topic]
    for field in fields:
        name, _, index = field.rstrip("]").partition("[")
        found = getattr(found, name)
        found = found[int(index)] if index else found
    return found


def test_foxglove_shows_the_robot_and_numbers_of_a_bag(seen: dict[str, Any]) -> None:
    found = json.loads((VIEWS / "foxglove.json").read_text("utf-8"))
    for name, panel in found["configById"].items():
        assert json.dumps(found["layout"]).count(f'"{name}"') == 1
        for path in panel.get("paths", ()):
            assert isinstance(value_of(path["value"], seen), float), path
    panel = found["configById"]["3D!robot"]
    assert panel["topics"]["/robot_description"]["visible"]
    assert set(panel["topics"]) <= set(SHOWN)
    assert panel["followTf"] == seen["/tf"].transforms[0].header.frame_id == topics.INERTIAL_FRAME


def test_errors_are_those_of_the_law_by_the_names_of_the_axes(
    paper_robot: Robot, seen: dict[str, Any]
) -> None:
    """Axes base x, y, z and six joints, whose numbers are the telemetry's."""
    signals, telemetry = seen["/controller/signals"], seen["/controller/telemetry"]
    names = list(paper_robot.axis_names)
    assert list(signals.name) == names
    stamp = signals.header.stamp
    assert stamp.sec * 2000 + stamp.nanosec / 500_000 == telemetry.data[0]
    rows = dict(
        zip(TELEMETRY_ROWS, telemetry.data[1:].reshape(len(TELEMETRY_ROWS), -1), strict=True)
    )
    for field, signal in (("position", "e"), ("velocity", "s"), ("effort", "n_hat")):
        assert getattr(signals, field).tolist() == rows[signal].tolist()
    plotted, layout = "/controller/signals", (VIEWS / "foxglove.json").read_text("utf-8")
    assert [int(i) for i in re.findall(rf"{plotted}\.position\[(\d+)\]", layout)] == [*range(9)]
    curves = (VIEWS / "plotjuggler.xml").read_text("utf-8")
    assert re.findall(rf"{plotted}/(\w+)/position", curves) == names


def curves_of(path: str, value: Any) -> Iterator[str]:
    """Names of the curves that PlotJuggler makes of a message."""
    if getattr(value, "__msgtype__", "") == "sensor_msgs/msg/JointState":
        for field in ("position", "velocity", "effort"):
            for name, _ in zip(value.name, getattr(value, field), strict=False):
                yield f"{path}/{name}/{field}"
    elif hasattr(value, "__msgtype__"):
        for field in value.__dataclass_fields__:
            if field != "__msgtype__":
                yield from curves_of(f"{path}/{field}", getattr(value, field))
    elif isinstance(value, str) or not hasattr(value, "__len__"):
        yield path
    else:
        for number, item in enumerate(value):
            yield from curves_of(f"{path}[{number}]", item)


def test_plotjuggler_curves_are_in_a_bag(seen: dict[str, Any]) -> None:
    root = ElementTree.parse(VIEWS / "plotjuggler.xml").getroot()
    known = {name for topic, message in seen.items() for name in curves_of(topic, message)}
    curves = [curve.attrib["name"] for curve in root.iter("curve")]
    assert set(curves) <= known
    assert len(curves) > 30


def test_rviz_listens_as_we_send(seen: dict[str, Any]) -> None:
    """Topics, their durability and the fixed frame; classes are those of RViz' own plugins."""
    found = yaml.safe_load((VIEWS / "fly.rviz").read_text("utf-8"))["Visualization Manager"]
    assert found["Global Options"]["Fixed Frame"] == topics.INERTIAL_FRAME
    displays = {display["Class"].rpartition("/")[2]: display for display in found["Displays"]}
    assert set(displays) == {"RobotModel", "TF", "MarkerArray"}  # and no floor
    assert all(display["Enabled"] for display in displays.values())
    heard = {
        SHOWN[given["Value"]]: given
        for given in (displays["RobotModel"]["Description Topic"], displays["MarkerArray"]["Topic"])
    }
    assert set(heard) == {topics.ROBOT_DESCRIPTION, topics.MARKERS}
    for topic, given in heard.items():
        durability = "Transient Local" if topic.transient_local else "Volatile"
        assert (given["Durability Policy"], given["Depth"]) == (durability, topic.depth)
        assert given["Reliability Policy"] == "Reliable"
