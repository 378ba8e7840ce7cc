"""Telemetry of the controller in flight: packets of what it knows at a tick."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.samples import (
    SIGNALS,
    LawInForce,
    RobotNames,
    RobotState,
    TelemetrySignals,
    Timebase,
)
from space_robot_msgs_py.signals import signals_of
from space_robot_msgs_py.telemetry.downlink import (
    EventKind,
    PacketWriter,
    Sink,
    TelemetryEvent,
    open_sink,
)
from space_robot_msgs_py.telemetry.structures import (
    REFERENCE_PREFIX,
    UNKNOWN_LAW,
    Structures,
    TelemetrySettings,
    numbers_of_laws,
)

from .settings import ControllerNodeSettings
from .supervisor import Supervisor
from .tick import NOMINAL, SAFE

Array = NDArray[np.float64]
LAW_SIGNALS = tuple(signals_of(TelemetrySignals))
INFORMATION, MEDIUM, HIGH = 1, 3, 4
"""Severities of events."""


def telemetry_structures(packets: str, names: RobotNames, timebase: Timebase) -> Structures:
    """Return the structures of a file of ``config/telemetry``, by name or path, for a robot.

    Raises:
        InputError: the file is wrong, or does not fit the robot.
    """
    path: Path = named_file("telemetry", packets)
    return Structures(TelemetrySettings.from_yaml(path), names, timebase, str(path))


class LiveTelemetry:
    """Sends packets and events of the controller at the ticks at which they are due."""

    def __init__(self, structures: Structures, sink: Sink, laws: Sequence[str]) -> None:
        """``laws``: names of those that have numbers in telemetry."""
        self._writer, self._sink = PacketWriter(structures), sink
        self._laws, self._mode = numbers_of_laws(laws), NOMINAL
        self._every = structures.every
        self._axes = len(structures.names.axes)

    @classmethod
    def from_settings(
        cls, settings: ControllerNodeSettings, names: RobotNames, laws: Sequence[str]
    ) -> Self | None:
        """Open what the settings of the controller's node ask for; None: no telemetry.

        Raises:
            InputError: the file of the packets or the destination cannot be used.
        """
        if not settings.telemetry:
            return None
        structures = telemetry_structures(settings.telemetry_packets, names, settings.timebase)
        return cls(structures, open_sink(settings.telemetry), laws)

    def report(
        self,
        state: RobotState,
        reference: Block,
        supervisor: Supervisor,
        torque: Array,
        change: LawInForce | None,
    ) -> None:
        """Send what is due at the tick of ``state``, which was answered with ``torque``.

        ``change``: the law that is in force from this tick on, if it is another one.
        """
        tick, mode, events = state.tick, supervisor.mode, []
        if mode == self._mode and not change and tick % self._every:
            return
        if change:
            number = self._laws.get(change.name, UNKNOWN_LAW)
            events.append(TelemetryEvent(tick, EventKind.LAW_IN_FORCE, number))
        if mode != self._mode:
            self._mode = mode
            severity = INFORMATION if mode == NOMINAL else HIGH if mode == SAFE else MEDIUM
            events.append(TelemetryEvent(tick, EventKind.MODE_ENTERED, mode, severity))

        def column(name: str) -> Array:
            if name == "law":
                return np.array([self._laws.get(supervisor.controller.law.name, UNKNOWN_LAW)])
            if name in SIGNALS:
                return np.asarray(state.block[name])
            if name.startswith(REFERENCE_PREFIX):
                return np.asarray(reference[name.removeprefix(REFERENCE_PREFIX)])
            if name in LAW_SIGNALS:
                return supervisor.telemetry()[LAW_SIGNALS.index(name)][np.newaxis]
            both = torque[np.newaxis]
            return both[:, : self._axes] if name == "commanded_torque" else both[:, self._axes :]

        self._sink.writelines(self._writer.packets(tick, tick + 1, column, events))

    def close(self) -> None:
        """Close the destination."""
        self._sink.close()
