"""Live scene of a running flight of this machine, whose newest states are a short `FlightLog`."""

from __future__ import annotations

import html
import json
import math
import time
from collections import deque
from collections.abc import Collection, Iterator, Sequence
from contextlib import closing, suppress
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array, unit_rows
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
from space_robot_msgs_py.wire.messages import Codec, MessageDescription, describe
from space_robot_msgs_py.wire.telemetry import LawCodec

from ..analysis.analysed_log import AnalysedLog
from ..analysis.plotted import PlottedQuantity, flown_quantities
from ..flight.graph.domain import domain_asked_for
from ..flight.graph.monitor import Monitor
from ..flight.graph.node_names import PLANT
from .scene import RobotScene, local_server, palette, rgb
from .shapes import extent
from .stage import clearest_side, set_stage

if TYPE_CHECKING:
    from viser import ViserServer

RATE_HZ, PANEL_EVERY, ROWS = 30, 6, 300
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

    Without a ``domain`` that of ROS_DOMAIN_ID or of the last started flight is followed, without
    a ``namespace`` any. Of ``plots``, kinds, the curves are shown first; empty: the usual ones.
    """
    namespace, wanted = full_namespace(namespace) if namespace else "", domain_asked_for(domain)
    with local_server(port) as server:
        # no share button: it would use an external server
        server.gui.configure_theme(dark_mode=dark, show_share_button=False, control_width="large")
        yield f"http://127.0.0.1:{server.get_port()}"
        while True:
            yield WAITING
            while not (places := _plants(wanted, namespace)):
                time.sleep(0.5)
            yield f"following the flight in {places[0][1]} of ROS domain {places[0][0]}"
            _follow(server, places[0], dark, plots)
            yield OVER


def _plants(domain: int | None, namespace: str) -> list[tuple[int, str]]:
    return [place for place in living_nodes(PLANT, namespace) if domain in (None, place[0])]


def _follow(server: ViserServer, place: tuple[int, str], dark: bool, plots: Sequence[str]) -> None:
    view, is_over = None, False
    with closing(Feed(place)) as feed:
        while not is_over:
            for _ in range(PANEL_EVERY):
                if feed.poll():
                    view = view or LiveView(server, feed, dark, plots)
                    view.show()
                time.sleep(1.0 / RATE_HZ)
            is_over = place not in _plants(*place)
            if view:
                view.update_panel(OVER if is_over else "")


class Feed:
    """The newest seconds of a running robot: true states if they are published, else measured."""

    def __init__(self, place: tuple[int, str]) -> None:
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
        self._described: dict[topics.Topic, MessageDescription] = {}
        self.law = ""

    def _begin(self, flight: dict[str, Any]) -> None:
        self.robot = Robot.from_dict(flight["robot_file"])
        self.actuators = BaseActuatorSettings(**flight.get("base_actuators", {}))
        names = self.actuators.robot_names(self.robot)
        ticks = Timebase(round(flight["period"] * 1e9))
        self._described = {topic: describe(topic, names, ticks) for topic in self._subscriptions}
        self._codecs = {topic: Codec(self._described[topic]) for topic in self._described}
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
        for topic, described in self._described.items():
            while (data := self._subscriptions[topic].take()) is not None:
                with suppress(MessageError):  # another robot's
                    stamp_ns, numbers = self._codecs[topic].decode(data)
                    table = numbers.reshape(-1, described.width).copy()
                    last_ns = stamp_ns + (len(table) - 1) * self.log.timebase.period_ns
                    self._tables[topic].append((last_ns, table))
        kinds = topics.TRUTH if all(map(self._tables.get, topics.TRUTH)) else MEASURED
        if not all(map(self._tables.get, kinds)):
            return False
        stamp_ns = min(self._tables[kind][-1][0] for kind in kinds)
        stamp_s, before = 1e-9 * stamp_ns, self.time[-1]
        rows = {topic: self._row(topic, stamp_ns) for topic in (*kinds, *DESIRED_MOTION)}
        if before - 1.0 < stamp_s <= before or any(rows[kind] is None for kind in kinds):
            return False  # faults may send an old state
        for column in (self.time, *self.log.columns.values()):
            column[:-1] = np.nan if stamp_s < before else column[1:]  # earlier: it was reset
            column[-1] = np.nan
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
            if 0 <= (back := (last_ns - stamp_ns) // self.log.timebase.period_ns) < len(table):
                return np.asarray(table[-1 - back])
        return None

    def pose(self, rows: slice | NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Return position and attitude of the base, and positions of all joints."""
        log = self.log  # measured quaternions are not exactly of unit length
        return log.base_position[rows], unit_rows(log.quaternion[rows]), log.all_positions[rows]

    def quantities(self, kinds: Collection[str] = ()) -> Iterator[tuple[str, PlottedQuantity]]:
        """Return what can be plotted, with its kind, see `flown_quantities`."""
        flight = AnalysedLog(self.log)
        flight.robot, flight.actuators = self.robot, self.actuators
        return flown_quantities(flight, kinds)


class LiveView:
    """Scene and panel of one robot; those of the flight before are removed."""

    def __init__(self, server: ViserServer, feed: Feed, dark: bool, plots: Sequence[str]) -> None:
        self._server, self._feed = server, feed
        robot, scene, gui, colours = feed.robot, server.scene, server.gui, palette(dark)
        scene.reset()
        gui.reset()
        gui.main_panel.dock_right()
        position, quaternion, angles = feed.pose(slice(-1, None))
        points = extent(robot, position, quaternion, angles)
        middle, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
        side = clearest_side([(robot, quaternion, angles)])
        set_stage(server, middle + ROOM * (points - middle), dark, side=side)
        self._robot = RobotScene(scene, "/robot", robot)
        nothing, colour = np.zeros((1, 2, 3)), rgb(colours[0])
        self._trail = scene.add_line_segments("/trail", nothing, colour, thickness=TRAIL * size)
        self._words, self._began = gui.add_html(""), (time.monotonic(), feed.time[-1])
        ink = "#c9d1d9" if dark else "#333333"
        axis: Any = {"stroke": ink, **{key: {"stroke": f"{ink}33"} for key in ("grid", "ticks")}}
        style: Any = {"height": 150, "legend": {"show": False}, "scales": {"x": {"time": False}}}
        folder, self._plots = gui.add_folder("Plots", expand_by_default=False), dict[str, Any]()
        for kind, quantity in feed.quantities():
            lines: list[Any] = [{"label": "s"}]
            for label, stroke in zip(quantity.labels, cycle(colours), strict=False):
                lines.append({"label": label, "stroke": stroke, "width": 1.5})
            empty = tuple(np.zeros((len(lines), 2)))
            plot = gui.add_uplot(
                empty, tuple(lines), title=quantity.label, axes=(axis, axis), **style
            )
            is_shown = kind in plots if plots else quantity.is_shown
            with folder:
                self._plots[quantity.label] = kind, gui.add_checkbox(quantity.title, is_shown), plot

    def show(self) -> None:
        """Move the robot."""
        # twice, because the scene treats a single row as a constant transform
        (position,), (quaternion,), angles = self._feed.pose(slice(-1, None))
        links = joint_transforms(self._feed.robot, np.tile(angles, (2, 1)))
        with self._server.atomic():
            self._robot.move(position, quaternion, links, 0)

    def update_panel(self, note: str) -> None:
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
            for _, quantity in feed.quantities(shown) if shown else ():
                if quantity.label in self._plots:
                    *_, plot = self._plots[quantity.label]
                    values = quantity.values[known]
                    largest = float(np.nanmax(np.abs(values), initial=0.0))
                    # the plot's tick labels have no exponents, so small values are scaled
                    exponent = 3 * math.floor(math.log10(largest) / 3) if largest > 0.0 else 0
                    plot.title = quantity.label + (f", 1e{exponent}" if exponent else "")
                    plot.data = (feed.time[known], *np.ascontiguousarray(values.T / 10.0**exponent))
