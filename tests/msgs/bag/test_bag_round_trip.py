"""Our bags through rosbags, with no type from us: only the definitions in the bag itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from robots import driven_paper
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight

OF_HARDWARE = {
    *(topics.WHEELS_STATE, topics.THRUSTERS_STATE, topics.MOTORS_STATE),
    *(topics.MAGNETOMETER, topics.TRUTH_ORBIT),
}
"""Topics that only some flights have."""
FLIGHTS: dict[str, tuple[dict[str, Any], set[topics.Topic]]] = {
    "paper": ({"robot": "paper"}, OF_HARDWARE),
    "seven_joint": ({"robot": "seven_joint"}, OF_HARDWARE),
    "in_orbit": (
        {
            "robot": Robot.from_dict(driven_paper()),
            "orbit": "iss",
            "actuators": "wheels_and_torquers",
        },
        {topics.THRUSTERS_STATE},
    ),
}
"""Options of each flight, and the topics that it does not have."""


@pytest.fixture(scope="module", params=FLIGHTS)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags") / request.param
    options = {"duration": 0.1, "sensors": "fine", **FLIGHTS[request.param][0]}
    simulate(Flight(resolve(FlightPlan.model_validate(options))), folder)
    return folder


def _types_in(bag: Path) -> Typestore:
    store = get_typestore(Stores.EMPTY)
    with next(bag.glob("*.mcap")).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        types = get_types_from_msg(schema.data.decode(), schema.name)
        store.register({n: fields for n, fields in types.items() if n not in store.fielddefs})
    return store


def test_every_message_serialised_again_is_the_same_bytes(bag: Path) -> None:
    """No exception is needed: lengths, padding and order are the standard's."""
    store, seen = _types_in(bag), set()
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw)
            seen.add(connection.topic)
    absent = FLIGHTS[bag.name][1]
    assert seen == {t.recorded.full_name for t in topics.RECORDED if t not in absent}


def test_definitions_have_the_hashes_the_bag_tells(bag: Path) -> None:
    store = _types_in(bag)
    with Reader(bag) as reader:
        for connection in reader.connections:
            assert store.hash_rihs01(connection.msgtype) == connection.digest


def test_copied_by_rosbags_it_is_the_same_flight(bag: Path, tmp_path: Path) -> None:
    store = _types_in(bag)
    copy = Writer(tmp_path / "copy", version=9, storage_plugin=StoragePlugin.MCAP)
    with Reader(bag) as reader, copy:
        for key, value in open_bag(bag).custom_data().items():
            copy.set_custom_data(key, value)
        connections = {
            c.topic: copy.add_connection(c.topic, c.msgtype, typestore=store)
            for c in reader.connections
        }
        for connection, time, raw in reader.messages():
            copy.write(connections[connection.topic], time, raw)
    assert analyze(read_flight(tmp_path / "copy")) == analyze(read_flight(bag))
