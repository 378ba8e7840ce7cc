"""A flight computer: the flight code in a program of its own, which answers by UDP.

Each request is one datagram, and so is each answer; examples/flight_computer has the other side.
"""

from __future__ import annotations

import socket
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import RobotState

from ..laws import ControlLaw
from .folder import Exported
from .library import FlightCode, fill_measurement, fill_reference

TIMEOUT_S = 2.0
"""Longest wait for an answer, s of the wall clock."""
LARGEST = 65_507
"""Bytes of a datagram at most."""
BEGIN, JUDGE, ANSWER, USE, STAND_DOWN = range(5)
"""Kinds of requests."""


class FlightComputer(FlightCode):
    """The flight software in a program that answers by UDP."""

    def __init__(self, exported: Exported, host: str, port: int) -> None:
        """Connect, and have the program begin anew.

        Raises:
            InputError: nobody answers, or the program is for another robot.
        """
        super().__init__(exported)
        request = [
            ("kind", np.int64),
            ("law", np.int64),
            ("measurement", self._measurement.dtype),
            ("reference", self._reference.dtype),
        ]
        answer = [
            ("kind", np.int64),
            ("tick", np.int64),
            ("result", np.int64),
            ("command", self._command.dtype),
            ("condition", np.float64, self._condition.shape),
            ("telemetry", np.float64, self._telemetry.shape),
        ]
        self._request: NDArray[Any] = np.zeros(1, request)
        self._dtype = np.dtype(answer)
        self._where = f"{host}:{port}"
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(TIMEOUT_S)
        try:
            self._socket.connect((host, port))
            self._ask(BEGIN, 0)
        except (OSError, FlightError) as error:
            raise InputError(
                f"controller_code udp:{self._where}: {error}; start the flight computer first"
            ) from None

    def _ask(self, kind: int, tick: int) -> int:
        self._request["kind"] = kind
        self._request["measurement"]["tick"] = tick
        try:
            self._socket.send(self._request.tobytes())
            data = self._socket.recv(LARGEST)
        except OSError as error:
            raise FlightError(f"the flight computer does not answer ({error})") from None
        if len(data) != (size := self._dtype.itemsize):
            raise FlightError(
                f"the flight computer answered {len(data)} bytes instead of {size}: "
                "its code was exported for another robot or other actuators"
            )
        answer = np.frombuffer(data, self._dtype)
        if (answer["kind"][0], answer["tick"][0]) != (kind, tick):
            raise FlightError("the flight computer answered another request")
        self._command, self._condition = answer["command"], answer["condition"][0]
        self._telemetry = answer["telemetry"][0]
        return int(answer["result"][0])

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""
        return self._ask(JUDGE, tick)

    def answer(self, state: RobotState, reference: Block) -> int:
        """Answer a state that was judged to be new; return its status."""
        fill_measurement(self._request["measurement"], state)
        fill_reference(self._request["reference"], reference)
        return self._ask(ANSWER, state.tick)

    def stand_down(self, tick: int) -> None:
        """Have the flight end with zero torque."""
        self._ask(STAND_DOWN, tick)

    def use(self, law: ControlLaw) -> None:
        """Let a law take over if another one is in force; its gains are the program's own."""
        self._request["law"] = self._places[law.name]
        self._ask(USE, 0)
