"""Serving the scene of what flies now, one flight after the other, until the user ends it."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING

from space_robot_msgs_py.errors import FlightError

from ...flight.graph.monitor import Event
from ..local_server import local_server
from .finder import Finder, Place
from .listener import Listener
from .view import LiveView

if TYPE_CHECKING:
    from viser import ViserServer

RATE_HZ = 30.0
"""Frames a second at most, by the wall clock."""
TELL_S = 0.2
"""How often words and curves are shown anew."""
LOOK_S = 0.5
"""How often a plant is looked for."""
WAITING, OVER = "waiting for a flight", "the flight is over"


@dataclass(frozen=True)
class LiveOptions:
    """What may be asked of a live scene."""

    domain: int | None = None
    """ROS domain; None: ROS_DOMAIN_ID, or that of the flight on this machine that began last."""
    namespace: str = ""
    """Of the robot; empty: any."""
    robot: str = ""
    """Name or file of the robot; empty: what its plant says."""
    port: int = 8080
    """Of the page; the next free one if it is taken."""
    dark: bool = True
    """Light on dark."""


class OverError(FlightError):
    """The flight that was followed is over."""


def serve(options: LiveOptions, say: Callable[[str], None], ready: Callable[[str], None]) -> None:
    """Serve the scene until a signal raises.

    Args:
        options: what is asked.
        say: told what happens, a line each.
        ready: told the page's address.

    Raises:
        InputError: viser is not installed, or a robot is not to be found.
        Interrupted: the user has ended it.
    """
    with (
        closing(Finder(options.domain, options.namespace)) as finder,
        local_server(options.port) as server,
    ):
        # no button to share: that would lead through a server somewhere
        server.gui.configure_theme(
            dark_mode=options.dark, show_logo=False, show_share_button=False, control_width="large"
        )
        server.gui.main_panel.dock_right()
        ready(f"http://127.0.0.1:{server.get_port()}")
        follower = Follower(server, finder, options)
        while True:
            say(WAITING)
            while (place := finder.find()) is None:
                time.sleep(LOOK_S)
            say(f"following the flight in {place}")
            try:
                follower.follow(place)
            except FlightError as error:
                say(str(error))


class Follower:
    """Shows one flight after the other; the last one stays to be seen until the next begins."""

    def __init__(self, server: ViserServer, finder: Finder, options: LiveOptions) -> None:
        self._server, self._finder, self._options = server, finder, options
        self._waiting = server.gui.add_markdown("Waiting for a flight.")
        self._view: LiveView | None = None

    def follow(self, place: Place) -> None:
        """Show the flight in a place to its end.

        Raises:
            OverError: it is over.
            FlightError: its plant does not answer.
            InputError: its robot is not to be found here.
        """

        def check() -> None:
            if not self._finder.is_there(place):
                raise OverError(OVER)

        with closing(Listener(place, self._options.robot, check)) as listener:
            events: list[Event] = []
            while (sample := listener.poll(self._is_watched, events)) is None:
                check()
                time.sleep(TELL_S)
            with self._server.atomic():
                if self._view:
                    self._view.close()
                self._waiting.visible = False
                self._view = LiveView(self._server, listener.robot, sample, self._options.dark)
            self._view.note(events)
            try:
                self._show(listener, self._view, check)
            except OverError as over:
                self._view.tell(listener, 0.0, str(over))
                raise

    def _show(self, listener: Listener, view: LiveView, check: Callable[[], None]) -> None:
        flown = tell_at = look_at = 0.0
        told = time.monotonic(), 0.0
        while True:
            began = time.monotonic()
            if began >= look_at:
                check()
                look_at = began + LOOK_S
            events: list[Event] = []
            sample = listener.poll(self._is_watched, events)
            view.note(events)
            if listener.time < flown:  # by the clock: faults may send old states
                raise OverError("the flight has begun anew")
            flown = listener.time
            if sample:
                view.show(sample)
            if self._is_watched and began >= tell_at:
                speed = (listener.time - told[1]) / max(began - told[0], TELL_S)
                view.tell(listener, speed)
                tell_at, told = began + TELL_S, (began, listener.time)
            time.sleep(max(0.0, began + 1.0 / RATE_HZ - time.monotonic()))

    @property
    def _is_watched(self) -> bool:
        return bool(self._server.get_clients())
