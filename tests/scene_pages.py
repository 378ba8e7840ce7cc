"""What a page made by `space-robot view` shows, read from the page alone, and logs for it."""

from __future__ import annotations

import base64
import html
import json
import re
from typing import Any, NamedTuple

import msgspec
import numpy as np
import zstandard
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.view.flights import ViewOptions, flights_page
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import RobotNames, Timebase

Message = dict[str, Any]


def page_of(robot: Robot, options: ViewOptions = ViewOptions(), **logs: FlightLog) -> str:  # noqa: B008
    """Return the page of flights of one robot."""
    return flights_page(logs, dict.fromkeys(logs, robot), options, lambda total: lambda: None)


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


MU = 3.986004418e14  # m3/s2
EARTH_RADIUS = 6378137.0  # m


def moving_log(
    robot: Robot, ticks: int, first_tick: int = 0, period_ns: int = 500_000
) -> FlightLog:
    """A log whose rows all differ, and tell their numbers: x of the base is the row."""
    names = RobotNames(robot.joint_names, passive=robot.passive_names)
    log = FlightLog.allocate(ticks, names, Timebase(period_ns))
    log.first_tick = first_tick
    rng = np.random.default_rng(ticks + first_tick)
    log.base_position[:] = np.column_stack([np.arange(ticks), np.zeros((ticks, 2))])
    log.quaternion[:] = Rotation.random(ticks, rng=rng).as_quat()
    log.joint_positions[:] = rng.uniform(-3.0, 3.0, log.joint_positions.shape)
    log.passive_positions[:] = 0.0
    log.reference_base[:, :4] = Rotation.random(ticks, rng=rng).as_quat()
    log.reference_joints[:, 0] = log.joint_positions + 0.1
    return log


class CircularOrbit(NamedTuple):
    """An orbit with the Sun; m, rad, N/m2.

    ``start`` is the angle from the ascending node, on x, at time 0; ``beta`` that of the Sun above
    the orbit's plane, ``noon`` that in the orbit at which it is noon; ``pressure`` is of sunlight.
    """

    height: float = 420e3
    inclination: float = 0.9
    start: float = 0.0
    beta: float = 0.5
    noon: float = 0.0
    pressure: float = 4.56e-6

    @property
    def radius(self) -> float:
        return EARTH_RADIUS + self.height

    @property
    def rate(self) -> float:
        """rad/s."""
        return float(np.sqrt(MU / self.radius**3))

    @property
    def _axes(self) -> Array:
        """Columns: to the node, 90 degrees ahead of it, normal."""
        s, c = np.sin(self.inclination), np.cos(self.inclination)
        return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])

    @property
    def sun(self) -> Array:
        in_plane = np.cos(self.beta) * np.array([np.cos(self.noon), np.sin(self.noon)])
        return np.asarray(self._axes @ [*in_plane, np.sin(self.beta)])

    def position(self, time: Array) -> Array:
        """(K, 3) m."""
        angle = self.start + self.rate * time
        on_plane = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
        return self.radius * on_plane @ self._axes.T

    def velocity(self, time: Array) -> Array:
        """(K, 3) m/s."""
        return self.rate * self._replace(start=self.start + 0.5 * np.pi).position(time)

    @property
    def parameters(self) -> dict[str, Any]:
        """The plant's, as a bag has them, where they are not what an orbit has by itself."""
        return {
            "orbital_elements.height": self.height,
            "orbital_elements.inclination_deg": float(np.degrees(self.inclination)),
            "orbital_elements.anomaly_deg": float(np.degrees(self.start)),
            "sunlight.pressure": self.pressure,
            "sunlight.beta_angle_deg": float(np.degrees(self.beta)),
            "sunlight.noon_deg": float(np.degrees(self.noon)),
        }


def orbiting_log(robot: Robot, orbit: CircularOrbit, ticks: int, period_ns: int) -> FlightLog:
    """Return a log in an orbit, with the base at the origin and no reference."""
    log = moving_log(robot, ticks, period_ns=period_ns)
    log.base_position[:] = 0.0
    log.reference_base[:], log.reference_joints[:] = np.nan, np.nan
    log.orbit_position, log.orbit_velocity = orbit.position(log.time), orbit.velocity(log.time)
    log.magnetic_field, log.external_torques = np.zeros((ticks, 3)), np.zeros((ticks, 12))
    log.flight = {
        "robot": robot.name,
        "robot_file": robot.content,
        "scenario": {"parameters": {"plant": orbit.parameters}},
    }
    return log
