"""What a page made by `space-robot view` shows, read from the page alone."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec
import numpy as np
import zstandard
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.view.flights import ViewOptions, flights_page
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]
Message = dict[str, Any]


def quiet(total: int) -> Callable[[], None]:
    """Show no progress."""
    return lambda: None


def page_of(robot: Robot, options: ViewOptions = ViewOptions(), **logs: FlightLog) -> str:  # noqa: B008
    """Return the page of flights of one robot."""
    return flights_page(logs, dict.fromkeys(logs, robot), options, quiet)


class Pose(NamedTuple):
    """Axes, as columns, and place on those of the scene."""

    rotation: Array
    position: Array


class Scene:
    """The nodes of a page's scene at a time, as its player has them."""

    def __init__(self, page: str) -> None:
        """Read a page of this project, or one of viser alone."""
        framed = re.search(r'srcdoc="([^"]*)"', page)
        document = html.unescape(framed[1]) if framed else page
        data = re.search(r'__VISER_EMBED_DATA__="([^"]*)"', document)
        assert data
        raw = zstandard.ZstdDecompressor().decompressobj().decompress(base64.b64decode(data[1])[8:])
        end = 8 + int.from_bytes(raw[:8], "little")
        content = msgspec.msgpack.decode(raw[8:end])
        self.duration: float = content["durationSeconds"]
        self.messages: list[tuple[float, Message]] = content["messages"]
        self._buffers: list[bytes] = []
        for length in content["binaryBufferLengths"]:
            start = end + -end % 8
            end = start + length
            self._buffers.append(raw[start:end])

    def times(self) -> list[float]:
        """The times at which something moves."""
        return sorted({time for time, _ in self.messages})

    def names(self) -> set[str]:
        """All nodes."""
        return {message["name"] for _, message in self.messages if "props" in message}

    def poses(self, time: float) -> dict[str, Pose]:
        """All nodes' poses once the player has come to ``time``."""
        position: dict[str, Array] = {}
        rotation: dict[str, Array] = {}
        for at, message in self.messages:
            if at > time:
                break
            if message["type"] == "SetPositionMessage":
                position[message["name"]] = np.array(message["position"])
            elif message["type"] == "SetOrientationMessage":
                w, x, y, z = message["wxyz"]
                rotation[message["name"]] = Rotation.from_quat([x, y, z, w]).as_matrix()
        found = {"": Pose(np.eye(3), np.zeros(3))}
        for name in sorted(self.names(), key=lambda name: name.count("/")):
            parent = found.get(name.rpartition("/")[0], found[""])
            turn, place = rotation.get(name, np.eye(3)), position.get(name, np.zeros(3))
            found[name] = Pose(parent.rotation @ turn, parent.position + parent.rotation @ place)
        return found

    def mesh(self, name: str) -> tuple[Array, NDArray[np.uint32]]:
        """Vertices and faces of a node that is a mesh."""
        props = next(
            message["props"]
            for _, message in self.messages
            if message["type"] == "MeshMessage" and message["name"] == name
        )
        vertices, faces = (
            np.frombuffer(self._buffers[held["__binary_index"]], held["dtype"]).reshape(-1, 3)
            for held in (props["vertices"], props["faces"])
        )
        return vertices.astype(np.float64), faces

    def visible(self, time: float) -> dict[str, bool]:
        """Of the nodes whose visibility was ever told, whether they are seen."""
        return {
            message["name"]: message["visible"]
            for at, message in self.messages
            if at <= time and message["type"] == "SetSceneNodeVisibilityMessage"
        }


def plot_data(page: str) -> dict[str, Any]:
    """What the page's plots and marks are made of."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert found
    content: dict[str, Any] = json.loads(found[1])
    return content
