"""Server of live scenes, one flight after the other, until it is stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING

from space_robot_msgs_py.errors import FlightError

from ...flight.graph.monitor import Event
from ..local_server import local_server
from .finder import Finder, FlightPlace
from .listener import Listener, Sample
from .view import LiveView

if TYPE_CHECKING:
    from viser import ViserServer

RATE_HZ = 30.0
"""Maximum frames per second of wall-clock time."""
TELL_S = 0.2
"""Period of updates of texts and curves, wall-clock time."""
FIRST_S = 0.02
"""Period of checks for the first state."""
LOOK_S = 0.5
"""Period of the search for a plant."""
SAY_S = 20.0
"""Period of the message that there is no flight."""
UNWATCHED_S = 60.0
"""Time from the start of a flight in which states are received without a browser."""
WAITING, OVER = "waiting for a flight", "the flight is over"
MISSED = "the flight was over before it could be shown; view shows its bag"


@dataclass(frozen=True)
class LiveOptions:
    """Options of a live scene."""

    domain: int | None = None
    """ROS domain; None: ROS_DOMAIN_ID, or that of the last started flight on this machine."""
    namespace: str = ""
    """Namespace of the robot; empty: any."""
    robot: str = ""
    """Name or file of the robot; empty: that of the plant."""
    port: int = 8080
    """Port of the page; the next free one if it is in use."""
    dark: bool = True
    """True for light on dark."""
    plots: tuple[str, ...] = ()
    """Kinds of the curves that are shown first, see `PLOT_KINDS`; empty: the usual ones."""


class OverError(FlightError):
    """The followed flight is over."""


def serve(options: LiveOptions, say: Callable[[str], None], ready: Callable[[str], None]) -> None:
    """Serve the scene until a signal interrupts.

    Args:
        options: of the scene.
        say: called with a line for each event.
        ready: called with the page's address.

    Raises:
        InputError: viser is not installed, or the files of a robot do not exist.
        Interrupted: stopped by the user.
    """
    with (
        closing(Finder(options.domain, options.namespace)) as finder,
        local_server(options.port) as server,
    ):
        # no share button: it would use an external server
        server.gui.configure_theme(
            dark_mode=options.dark, show_logo=False, show_share_button=False, control_width="large"
        )
        server.gui.main_panel.dock_right()
        ready(f"http://127.0.0.1:{server.get_port()}")
        follower = Follower(server, finder, options)
        while True:
            place = _wait(finder, say)
            say(f"following the flight in {place}")
            try:
                follower.follow(place, say)
            except FlightError as error:
                say(str(error))


def _wait(finder: Finder, say: Callable[[str], None]) -> FlightPlace:
    """Wait for a flight, and regularly report the state of the search."""
    say(WAITING)
    say_at = time.monotonic() + SAY_S
    while (place := finder.find()) is None:
        time.sleep(LOOK_S)
        if time.monotonic() >= say_at:
            say(f"still {WAITING}: {finder.describe()}")
            say_at = time.monotonic() + SAY_S
    return place


class Follower:
    """Shows one flight after the other; the last one stays visible until the next starts."""

    def __init__(self, server: ViserServer, finder: Finder, options: LiveOptions) -> None:
        self._server, self._finder, self._options = server, finder, options
        self._waiting = server.gui.add_markdown("Waiting for a flight.")
        self._view: LiveView | None = None
        self._began = 0.0
        """Time at which the flight was first shown, monotonic clock, s."""

    def follow(self, place: FlightPlace, say: Callable[[str], None]) -> None:
        """Show a flight until its end.

        Args:
            place: domain and namespace of the flight.
            say: called with a line for each event.

        Raises:
            OverError: the flight is over.
            FlightError: its plant does not answer.
            InputError: the files of its robot do not exist on this machine.
        """

        def check() -> None:
            if not self._finder.is_there(place):
                raise OverError(OVER)

        self._waiting.content = f"Joining the flight in {place}."
        with closing(self._join(place, check)) as listener:
            say(f"its robot is {listener.robot.name}; waiting for its first state")
            events: list[Event] = []
            sample = self._first_sample(listener, events, check)
            with self._server.atomic():
                if self._view:
                    self._view.close()
                self._waiting.visible = False
                self._view = LiveView(
                    self._server,
                    listener.robot,
                    sample,
                    self._options.dark,
                    listener.orbit,
                    listener.actuators,
                    self._options.plots,
                )
            say(f"showing it from {sample.time:.2f} s on")
            self._began = time.monotonic()
            self._view.note(events)
            try:
                self._show(listener, self._view, check)
            except OverError as over:
                self._view.tell(listener, 0.0, str(over))
                raise

    def _join(self, place: FlightPlace, check: Callable[[], None]) -> Listener:
        try:
            return Listener(place, self._options.robot, check)
        except OverError:
            raise OverError(MISSED) from None

    def _first_sample(
        self, listener: Listener, events: list[Event], check: Callable[[], None]
    ) -> Sample:
        """Wait for the first sample; if the flight ends before, return the last received one."""
        while True:
            if sample := listener.poll(True, events):
                return sample
            try:
                check()
            except OverError:
                if sample := listener.poll(True, events):
                    return sample
                raise OverError(MISSED) from None
            time.sleep(FIRST_S)

    def _show(self, listener: Listener, view: LiveView, check: Callable[[], None]) -> None:
        flown = tell_at = look_at = 0.0
        last_shown = time.monotonic(), 0.0
        while True:
            began = time.monotonic()
            if began >= look_at:
                check()
                look_at = began + LOOK_S
            events: list[Event] = []
            sample = listener.poll(self._is_wanted, events)
            view.note(events)
            if listener.time < flown:  # the clock, because faults may send old states
                raise OverError("the flight has been restarted")
            flown = listener.time
            if sample:
                view.show(sample)
            if self._is_watched and began >= tell_at:
                speed = (listener.time - last_shown[1]) / max(began - last_shown[0], TELL_S)
                view.tell(listener, speed)
                tell_at, last_shown = began + TELL_S, (began, listener.time)
            time.sleep(max(0.0, began + 1.0 / RATE_HZ - time.monotonic()))

    @property
    def _is_wanted(self) -> bool:
        return self._is_watched or time.monotonic() < self._began + UNWATCHED_S

    @property
    def _is_watched(self) -> bool:
        return bool(self._server.get_clients())
