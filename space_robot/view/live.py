"""Live scene of a running flight of this machine, for its browsers.

The newest states and references are a short `FlightLog`, of which the same plots are drawn as of a
bag.
"""

from __future__ import annotations

import html
import math
import time
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from itertools import count, cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.placements import joint_transforms, tool_pose
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.files import nest
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.config.validation import full_namespace, validate
from space_robot_msgs_py.errors import FlightError, MessageError
from space_robot_msgs_py.ros.locks import living_nodes
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.messages import Codec, describe
from space_robot_msgs_py.wire.telemetry import LawCodec

from ..analysis.analysed_log import AnalysedLog
from ..analysis.plotted import quantities_of
from ..flight.graph.domain import domain_asked_for
from ..flight.graph.monitor import Monitor
from ..flight.graph.node_names import PLANT
from ..flight.graph.node_services import get_parameters
from .extent import extent
from .scene import RobotScene, local_server, palette, rgb
from .stage import clearest_side, set_stage

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

RATE_HZ, TELL_EVERY, ROWS = 30, 6, 300
"""Frames per second of wall-clock time, frames between updates of texts and curves, and rows of the
log: ten seconds or more."""
SEARCH_S = 0.5
"""Period of the search for a plant."""
KEPT, CHUNKS_KEPT = 4, 50
"""Number of kept states per topic, so that all have one of the same tick, and of references."""
MEASURED = (topics.JOINT_STATES, topics.BASE_STATE)
REFERENCE = (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
HARDWARE = (topics.WHEELS_STATE, topics.THRUSTERS_STATE)
WAITING, OVER = "waiting for a flight", "the flight is over"
ROOM, TRAIL = 1.3, 0.0035
"""Field of the first camera and width of trails, relative to the robot in its first pose."""
FIRST_SHOWN = ("attitude", "joints", "torques")


def serve(
    domain: int | None,
    namespace: str,
    port: int,
    dark: bool,
    plots: Sequence[str],
    say: Callable[[str], None],
    ready: Callable[[str], None],
) -> None:
    """Serve one flight after the other until a signal interrupts.

    Args:
        domain: ROS domain; None: ROS_DOMAIN_ID, or that of the last started flight.
        namespace: of the robot; empty: any.
        port: of the page; the next free one if it is in use.
        dark: whether the page is light on dark.
        plots: kinds of the curves that are shown first; empty: errors and torques.
        say: called with a line for each event.
        ready: called with the page's address.
    """
    namespace, wanted = full_namespace(namespace) if namespace else "", domain_asked_for(domain)
    with local_server(port) as server:
        # no share button: it would use an external server
        server.gui.configure_theme(dark_mode=dark, show_share_button=False, control_width="large")
        server.gui.main_panel.dock_right()
        ready(f"http://127.0.0.1:{server.get_port()}")
        while True:
            say(WAITING)
            while not (places := _places(wanted, namespace)):
                time.sleep(SEARCH_S)
            say(f"following the flight in {places[0][1]} of ROS domain {places[0][0]}")
            try:
                _follow(server, places[0], dark, plots or FIRST_SHOWN)
            except FlightError as error:
                say(str(error))


def _places(domain: int | None, namespace: str) -> list[tuple[int, str]]:
    """Return domain and namespace of this machine's plants, the last started one first."""
    return [place for place in living_nodes(PLANT, namespace) if domain in (None, place[0])]


def _follow(server: ViserServer, place: tuple[int, str], dark: bool, plots: Sequence[str]) -> None:
    """Show a flight until its end, which is raised as an error."""

    def check() -> None:
        if place not in _places(*place):
            raise FlightError(OVER)

    view = None
    try:
        with closing(Feed(place, check)) as feed:
            for frame in count():
                if feed.poll():
                    view = view or LiveView(server, feed, dark, plots)
                    view.show()
                if frame % TELL_EVERY == 0:
                    check()
                    if view:
                        view.tell()
                time.sleep(1.0 / RATE_HZ)
    except FlightError as over:
        if view:
            view.tell(str(over))
        raise


class Feed:
    """The newest seconds of a running robot: true states if they are published, else measured."""

    def __init__(self, place: tuple[int, str], check: Callable[[], None]) -> None:
        """Join the graph in a domain and namespace, and request the plant's parameters.

        ``check``: called while waiting for the plant; may raise an error to stop.
        """
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self.monitor, group = Monitor(*place, "viewer"), PolledCallbackGroup()
        node, self.close = self.monitor.node, self.monitor.close
        try:
            # before the request: a short flight may be over when the plant has answered
            self._subscriptions = {
                topic: RawSubscription(node, topic, group, 0 if topic in REFERENCE else KEPT, True)
                for topic in (*topics.TRUTH, *MEASURED, *REFERENCE, *HARDWARE)
            }
            self._laws = RawSubscription(node, topics.LAW, group)
            keys = ["robot", "period", *(key for key, _ in leaves(BaseActuatorSettings))]
            values = [None]
            while not all(values[:2]):  # an unconfigured plant has neither
                check()
                values = get_parameters(node, PLANT, keys, check)
            self.robot = robot = find_robot(str(values[0]))
        except BaseException:
            self.close()
            raise
        tree = nest(dict(zip(keys[2:], values[2:], strict=True)))
        self.actuators = validate(BaseActuatorSettings, tree, "the plant's parameters")
        names, ticks = self.actuators.robot_names(robot), Timebase(round(values[1] * 1e9))
        self._period_ns = ticks.period_ns
        self._described = {topic: describe(topic, names, ticks) for topic in self._subscriptions}
        self._codecs = {topic: Codec(described) for topic, described in self._described.items()}
        self._tables: dict[topics.Topic, dict[int, Array]] = {t: {} for t in self._codecs}
        """Rows of the newest messages, by the stamp of the first, ns."""
        self.log, self.time = FlightLog.allocate(ROWS, names, ticks), np.full(ROWS, np.nan)
        """The newest states, the last one at the end, and their times, s."""
        slides = zip(robot.all_joint_names, robot.is_prismatic, strict=True)
        self.log.flight = {
            "prismatic_joints": [joint for joint, is_prismatic in slides if is_prismatic],
            "branches": list(robot.branches),
            "base_actuators": {"base_actuation": self.actuators.base_actuation},
        }
        self.law = ""

    def poll(self) -> bool:
        """Take the messages; return True if there is a new state of base and joints of one tick."""
        self.monitor.poll()
        while (data := self._laws.take()) is not None:
            with suppress(MessageError):
                self.law = LawCodec.decode(data, 0).name
        for topic, subscription in self._subscriptions.items():
            tables, width = self._tables[topic], self._described[topic].width
            while (data := subscription.take()) is not None:
                with suppress(MessageError):  # another robot's
                    stamp_ns, numbers = self._codecs[topic].decode(data)
                    table = numbers.reshape(-1, width)
                    first = 0 if topic in REFERENCE else len(table) - 1
                    tables[stamp_ns + first * self._period_ns] = table[first:].copy()
            while len(tables) > (CHUNKS_KEPT if topic in REFERENCE else KEPT):
                del tables[next(iter(tables))]
        kinds = topics.TRUTH if all(map(self._tables.get, topics.TRUTH)) else MEASURED
        stamp_ns = max(set.intersection(*(set(self._tables[kind]) for kind in kinds)), default=-1)
        stamp_s, before = 1e-9 * stamp_ns, self.time[-1]
        if stamp_ns < 0 or before - 1.0 < stamp_s <= before:  # faults may send an old state
            return False
        for column in (self.time, *self.log.columns.values()):
            if stamp_s < before:  # the simulation was reset
                column[:] = np.nan
            column[:-1], column[-1] = column[1:], np.nan
        self.time[-1] = stamp_s
        for topic, tables in self._tables.items():
            if topic in kinds or (topic in HARDWARE and tables):
                start_ns = stamp_ns if topic in kinds else max(tables)
                self._fill(topic, tables[start_ns][0])
            for start_ns, table in tables.items() if topic in REFERENCE else ():
                if 0 <= (at := (stamp_ns - start_ns) // self._period_ns) < len(table):
                    self._fill(topic, table[at])
        return True

    def _fill(self, topic: topics.Topic, values: Array) -> None:
        at = 0
        for name, first, length in self._described[topic].columns:
            row = getattr(self.log, name)[-1].reshape(-1)
            row[first : first + length] = values[at : at + length]
            at += length

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
        position, *pose = feed.pose(slice(-1, None))
        points = extent(robot, position, *pose)
        middle, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
        room, side = middle + ROOM * (points - middle), clearest_side([(robot, *pose)])
        set_stage(server, room, dark, side=side)
        self._robot = RobotScene(scene, "/robot", robot)
        self._trails = [
            scene.add_line_segments(
                f"/trail_{tool.name}", np.zeros((1, 2, 3)), rgb(colours[0]), thickness=TRAIL * size
            )
            for tool in robot.tools
        ]
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
                visible=kind in plots,
            )
            with folder:
                box = gui.add_checkbox(quantity.title, kind in plots)
            box.on_update(lambda event, plot=plot: setattr(plot, "visible", event.target.value))
            self._plots[quantity.label] = kind, plot

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
        feed, values = self._feed, self._feed.monitor.values.get(PLANT, {})
        speed = (feed.time[-1] - self._began[1]) / max(time.monotonic() - self._began[0], 0.1)
        problems = [f"{node}: {mode}" for node, mode in feed.monitor.complaints.items()]
        problems += [f"faults: {values['faults']}"] if "faults" in values else []
        clock = f"<b>{feed.time[-1]:.2f} s</b> &times;{speed:.2f} real time"
        text = map(html.escape, (feed.law or "...", feed.robot.name, *problems, note))
        known = np.isfinite(feed.time)
        position, *pose = feed.pose(known)
        with self._server.atomic():
            self._words.content = f"<div style='padding: 1em'>{'<br>'.join([clock, *text])}</div>"
            for tool, trail in zip(feed.robot.tools, self._trails, strict=True):
                places = position + tool_pose(replace(feed.robot, tools=(tool,)), *pose)[1]
                if len(places) > 1:
                    trail.points = np.stack([places[:-1], places[1:]], axis=1)
            shown = {kind for kind, plot in self._plots.values() if plot.visible}
            for _, quantity in quantities_of(self._flight, shown) if shown else ():
                _, plot = self._plots.get(quantity.label, ("", None))
                if plot and plot.visible:
                    values = quantity.values[known]
                    largest = float(np.nanmax(np.abs(values), initial=0.0))
                    # the plot's tick labels have no exponents, so small values are scaled
                    exponent = 3 * math.floor(math.log10(largest) / 3) if largest > 0.0 else 0
                    plot.title = quantity.label + (f", 1e{exponent}" if exponent else "")
                    plot.data = (feed.time[known], *np.ascontiguousarray(values.T / 10.0**exponent))
