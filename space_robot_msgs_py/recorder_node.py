"""recorder_node: every message of the graph into a bag."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import NoReturn

from . import topics
from .bag.recorder import BagRecorder
from .errors import InputError
from .health import Health, Level
from .recorder_settings import RecorderNodeSettings
from .ros.endpoints import In, Out, TakenByLoop
from .ros.shell import Shell, run_node

SILENCE_S = 0.3
"""Told to stop, the recorder leaves when nothing has come for this long."""
QUEUE_DEPTH = 20_000
TURN = 100
"""Messages taken of one topic before the next has its turn."""
NICENESS = 5
"""The loop goes first where cores are short; the queues hold seconds of traffic."""


class RecorderLoop:
    """Empties the queues of all topics in turn; deep queues bridge the time between rounds."""

    def __init__(self, shell: Shell, settings: RecorderNodeSettings) -> None:
        self._shell, self._settings = shell, settings
        try:
            flight = json.loads(settings.flight)
        except json.JSONDecodeError as error:
            raise InputError(f"recorder parameters: flight: not JSON ({error})") from None
        path = Path(settings.bag or time.strftime("bag_%Y%m%d-%H%M%S"))
        self._recorder = BagRecorder(
            path, {"period": settings.period, **flight}, settings.timebase,
            settings.compression, settings.split_size,
        )  # fmt: skip
        self.outputs: tuple[Out, ...] = ()
        group = TakenByLoop()
        self._inputs = [In(shell.node, topic, group, QUEUE_DEPTH) for topic in topics.ALL]
        self._told = False
        shell.log(f"recording to {path}")

    @property
    def failure(self) -> str:
        """Why the bag is no longer written (empty: all is well)."""
        return self._recorder.failure

    def run(self) -> None:
        """Record until told to stop and everything sent has come."""
        os.nice(max(0, NICENESS - os.nice(0)))
        last_arrival = time.monotonic()
        while not self._shell.stopping or time.monotonic() - last_arrival < SILENCE_S:
            # in turns: a backlog of one topic must not hold up the others
            counts = [self._take_some(entry) for entry in self._inputs]
            if any(counts):
                last_arrival = time.monotonic()
            self._recorder.flush_if_due()
            self._tell_failure()
            self._shell.serve()
            if max(counts) < TURN:
                time.sleep(self._settings.drain_period)
        self._recorder.flush()

    def stand_down(self) -> None:
        """Everything sent is in the bag when `run` returns."""

    def health(self) -> Health:
        """What has come, and whether it is kept."""
        values = {"received": self._recorder.received}
        if self.failure:
            return Health(f"not recording: {self.failure}", Level.ERROR, values)
        return Health("nominal", values=values)

    def close(self) -> None:
        """Close the bag.

        Raises:
            FlightError: the bag could not be written to its end.
        """
        lost = {name: count for name, count in self._recorder.lost.items() if count}
        self._shell.log(f"{self._recorder.received} messages received, missing: {lost or 0}")
        self._recorder.close()

    def _take_some(self, entry: In) -> int:
        for count in range(TURN):
            if (taken := entry.take_with_time()) is None:
                return count
            self._recorder.record(entry.topic, *taken)
            os.sched_yield()  # Linux may make a waking thread wait until we enter the kernel
        return TURN

    def _tell_failure(self) -> None:
        if self.failure and not self._told:
            self._told = True
            self._shell.log(f"the bag is no longer written: {self.failure}; the flight goes on")


def main() -> NoReturn:
    """Entry point of recorder_node."""
    run_node(RecorderNodeSettings, RecorderLoop)


if __name__ == "__main__":
    main()
