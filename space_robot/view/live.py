"""Live scene of a running flight of this machine, for its browsers.

The newest states and references are a short `FlightLog`, drawn as that of a bag.
"""

from __future__ import annotations

import html
import json
import math
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from itertools import count, cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import joint_transforms, tool_pose
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import full_namespace
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.locks import living_nodes
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.messages import Codec, describe
from space_robot_msgs_py.wire.telemetry import LawCodec

from ..analysis.analysed_log import AnalysedLog
from ..analysis.plotted import quantities_of
from ..flight.graph.domain import domain_asked_for
from ..flight.graph.monitor import Monitor
from ..flight.graph.node_names import PLANT
from .extent import extent
from .scene import RobotScene, local_server, palette, rgb
from .stage import clearest_side, set_stage

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

RATE_HZ, TELL_EVERY, ROWS = 30, 6, 300
"""Frames a second, frames between updates of texts and curves, and rows of the log: ten seconds."""
KEPT, CHUNKS_KEPT = 4, 50
"""Number of kept states per topic, so that all have one of the same tick, and of references."""
MEASURED = (topics.JOINT_STATES, topics.BASE_STATE)
DESIRED_MOTION = (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
HARDWARE = (topics.WHEELS_STATE, topics.THRUSTERS_STATE)
DESCRIPTION_KEYS = ("base_actuators", "branches", "prismatic_joints")
"""Keys of the plant's description that quantities depend on."""
WAITING, OVER = "waiting for a flight", "the flight is over"
ROOM, TRAIL = 1.3, 0.0035
"""Field of the first camera and width of trails, relative to the robot in its first pose."""


def serve(
    domain: int | None, namespace: str, port: int, dark: bool, plots: Sequence[str]
) -> Iterator[str]:
    """Serve one flight after the other; yield the page's address, then what happens, in words.

    Args:
        domain: ROS domain; None: ROS_DOMAIN_ID, or that of the last started flight.
        namespace: of the robot; empty: any.
        port: of the page; the next free one if it is in use.
        dark: whether the page is light on dark.
        plots: kinds of the curves that are shown first; empty: the usual ones.
    """
    namespace, wanted = full_namespace(namespace) if namespace else "", domain_asked_for(domain)
    with local_server(port) as server:
        # no share button: it would use an external server
        server.gui.configure_theme(dark_mode=dark, show_share_button=False, control_width="large")
        yield f"http://127.0.0.1:{server.get_port()}"
        while True:
            yield WAITING
            while not (places := _places(wanted, namespace)):
                time.sleep(0.5)
            yield f"following the flight in {places[0][1]} of ROS domain {places[0][0]}"
            _follow(server, places[0], dark, plots)
            yield OVER


def _places(domain: int | None, namespace: str) -> list[tuple[int, str]]:
    """Return domain and namespace of this machine's plants, the last started one first."""
    return [place for place in living_nodes(PLANT, namespace) if domain in (None, place[0])]


def _follow(server: ViserServer, place: tuple[int, str], dark: bool, plots: Sequence[str]) -> None:
    """Show a flight until its end."""
    view, is_over = None, False
    with closing(Feed(place)) as feed:
        for frame in count():
            if feed.poll():
                view = view or LiveView(server, feed, dark, plots)
                view.show()
            if frame % TELL_EVERY == 0:
                is_over = place not in _places(*place)
                if view:
                    view.tell(OVER if is_over else "")
            if is_over:
                return
            time.sleep(1.0 / RATE_HZ)


class Feed:
    """The newest seconds of a running robot: true states if they are published, else measured."""

    def __init__(self, place: tuple[int, str]) -> None:
        """Join the graph in a domain and namespace."""
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self.monitor, group = Monitor(*place, "viewer"), PolledCallbackGroup()
        node, self.close = self.monitor.node, self.monitor.close
        self._subscriptions, self._tables = {}, {}
        """Rows of the newest messages, with the stamp of the last one, ns."""
        for topic in (*topics.TRUTH, *MEASURED, *DESIRED_MOTION, *HARDWARE):
            kept = CHUNKS_KEPT if topic in DESIRED_MOTION else KEPT
            self._subscriptions[topic] = RawSubscription(node, topic, group, kept, True)
            self._tables[topic] = deque[tuple[int, Array]](maxlen=kept)
        self._laws = RawSubscription(node, topics.LAW, group)
        self._description = RawSubscription(node, topics.PLANT_DESCRIPTION, group)
        self._codecs: dict[topics.Topic, Codec] = {}
        self.law = ""

    def _begin(self, flight: dict[str, Any]) -> None:
        """Make an empty log of what the plant describes."""
        self.robot = Robot.from_dict(flight["robot_file"])
        self.actuators = BaseActuatorSettings(**flight.get("base_actuators", {}))
        names = self.actuators.robot_names(self.robot)
        ticks = Timebase(round(flight["period"] * 1e9))
        self._period_ns = ticks.period_ns
        self._described = {topic: describe(topic, names, ticks) for topic in self._subscriptions}
        self._codecs = {topic: Codec(described) for topic, described in self._described.items()}
        self.log, self.time = FlightLog.allocate(ROWS, names, ticks), np.full(ROWS, np.nan)
        """The newest states, the last one at the end, and their times, s."""
        self.log.flight = {key: flight[key] for key in DESCRIPTION_KEYS if key in flight}

    def poll(self) -> bool:
        """Take the messages; return True if there is a new state of base and joints of one tick."""
        self.monitor.poll()
        while (data := self._laws.take()) is not None:
            with suppress(MessageError):
                self.law = LawCodec.decode(data, 0).name
        if (data := self._description.take()) is not None:
            self._begin(json.loads(decode(data, topics.PLANT_DESCRIPTION.type).data))
        for topic, codec in self._codecs.items():  # none before the description
            while (data := self._subscriptions[topic].take()) is not None:
                with suppress(MessageError):  # another robot's
                    stamp_ns, numbers = codec.decode(data)
                    table = numbers.reshape(-1, self._described[topic].width).copy()
                    last_ns = stamp_ns + (len(table) - 1) * self._period_ns
                    self._tables[topic].append((last_ns, table))
        kinds = topics.TRUTH if all(map(self._tables.get, topics.TRUTH)) else MEASURED
        if not all(map(self._tables.get, kinds)):
            return False
        stamp_ns = min(self._tables[kind][-1][0] for kind in kinds)
        rows = {topic: self._row(topic, stamp_ns) for topic in (*kinds, *DESIRED_MOTION)}
        stamp_s, before = 1e-9 * stamp_ns, self.time[-1]
        if before - 1.0 < stamp_s <= before or any(rows[kind] is None for kind in kinds):
            return False  # faults may send an old state
        for column in (self.time, *self.log.columns.values()):
            if stamp_s < before:  # the simulation was reset
                column[:] = np.nan
            column[:-1], column[-1] = column[1:], np.nan
        self.time[-1] = stamp_s
        rows |= {topic: self._tables[topic][-1][1][-1] for topic in HARDWARE if self._tables[topic]}
        for topic, row in rows.items():
            at = 0
            for name, first, length in self._described[topic].columns if row is not None else ():
                column = getattr(self.log, name)[-1].reshape(-1)
                column[first : first + length] = np.asarray(row)[at : at + length]
                at += length
        return True

    def _row(self, topic: topics.Topic, stamp_ns: int) -> Array | None:
        for last_ns, table in reversed(self._tables[topic]):
            if 0 <= (back := (last_ns - stamp_ns) // self._period_ns) < len(table):
                return np.asarray(table[-1 - back])
        return None

    def pose(self, rows: slice | NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Return position and attitude of the base, and positions of all joints."""
        log = self.log  # measured quaternions are not exactly of unit length
        return log.base_position[rows], unit_rows(log.quaternion[rows]), log.all_positions[rows]


class LiveView:
    """Scene and panel of one robot; those of the flight before are removed."""

    def __init__(self, server: ViserServer, feed: Feed, dark: bool, plots: Sequence[str]) -> None:
        self._server, self._feed = server, feed
        robot, scene, gui, colours = feed.robot, server.scene, server.gui, palette(dark)
        scene.reset()
        gui.reset()
        gui.main_panel.dock_right()
        position, *pose = feed.pose(slice(-1, None))
        points = extent(robot, position, *pose)
        middle, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
        side = clearest_side([(robot, pose[0], pose[1])])
        set_stage(server, middle + ROOM * (points - middle), dark, side=side)
        self._robot = RobotScene(scene, "/robot", robot)
        nothing, colour = np.zeros((1, 2, 3)), rgb(colours[0])
        self._trail = scene.add_line_segments("/trail", nothing, colour, thickness=TRAIL * size)
        self._words, self._began = gui.add_html(""), (time.monotonic(), feed.time[-1])
        ink = "#c9d1d9" if dark else "#333333"
        axis: Any = {"stroke": ink, **{key: {"stroke": f"{ink}33"} for key in ("grid", "ticks")}}
        folder, self._plots = gui.add_folder("Plots", expand_by_default=False), dict[str, Any]()
        for kind, quantity in quantities_of(self._flight):
            lines: list[Any] = [
                {"label": label, "stroke": colour, "width": 1.5}
                for label, colour in zip(quantity.labels, cycle(colours), strict=False)
            ]
            plot = gui.add_uplot(
                tuple(np.zeros((len(lines) + 1, 2))),
                ({"label": "s"}, *lines),
                title=quantity.label,
                height=150,
                axes=(axis, axis),
                scales={"x": {"time": False}},
                legend={"show": False},
            )
            with folder:
                box = gui.add_checkbox(
                    quantity.title, kind in plots if plots else quantity.is_shown
                )
            self._plots[quantity.label] = kind, box, plot

    @property
    def _flight(self) -> AnalysedLog:
        flight = AnalysedLog(self._feed.log)
        flight.robot, flight.actuators = self._feed.robot, self._feed.actuators
        return flight

    def show(self) -> None:
        """Move the robot."""
        # twice, because the scene treats a single row as a constant transform
        (position,), (quaternion,), angles = self._feed.pose(slice(-1, None))
        with self._server.atomic():
            links = joint_transforms(self._feed.robot, np.tile(angles, (2, 1)))
            self._robot.move(position, quaternion, links, 0)

    def tell(self, note: str = "") -> None:
        """Update text, trails and curves; ``note`` is an additional sentence."""
        feed, known = self._feed, np.isfinite(self._feed.time)
        speed = (feed.time[-1] - self._began[1]) / max(time.monotonic() - self._began[0], 0.1)
        clock = f"<b>{feed.time[-1]:.2f} s</b> &times;{speed:.2f} real time"
        problems = [f"{node}: {mode}" for node, mode in feed.monitor.complaints.items()]
        text = map(html.escape, (feed.law or "...", feed.robot.name, *problems, note))
        position, *pose = feed.pose(known)
        places = position + tool_pose(feed.robot, *pose)[1]
        with self._server.atomic():
            self._words.content = f"<div style='padding: 1em'>{'<br>'.join([clock, *text])}</div>"
            if len(places) > 1:
                self._trail.points = np.stack([places[:-1], places[1:]], axis=1)
            for _, box, plot in self._plots.values():
                plot.visible = box.value
            shown = {kind for kind, box, _ in self._plots.values() if box.value}
            for _, quantity in quantities_of(self._flight, shown) if shown else ():
                if quantity.label in self._plots:
                    _, _, plot = self._plots[quantity.label]
                    values = quantity.values[known]
                    largest = float(np.nanmax(np.abs(values), initial=0.0))
                    # the plot's tick labels have no exponents, so small values are scaled
                    exponent = 3 * math.floor(math.log10(largest) / 3) if largest > 0.0 else 0
                    plot.title = quantity.label + (f", 1e{exponent}" if exponent else "")
                    plot.data = (feed.time[known], *np.ascontiguousarray(values.T / 10.0**exponent))
