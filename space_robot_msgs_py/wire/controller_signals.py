"""/controller/signals: telemetry with names of the axes, for external plotting tools."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..samples import RobotNames, Timebase
from .codec import Codec
from .joint_states import JointStates

Array = NDArray[np.float64]


class ControllerSignals(JointStates):
    """A sensor_msgs/JointState; its fields are e, s and the estimate N_hat in their units."""

    topic = topics.SIGNALS
    frame_id = topics.BASE_FRAME

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> ControllerSignals:
        """Describe the messages for the controlled axes."""
        return cls(names.axes, timebase)


class SignalsCodec:
    """Encodes e, s and N_hat of a tick."""

    def __init__(self, axis_names: Sequence[str], timebase: Timebase) -> None:
        self._codec = Codec(ControllerSignals(axis_names, timebase))
        self._timebase = timebase

    def encode(self, tick: int, e: Array, s: Array, n_hat: Array) -> bytes:
        """Return the bytes for the signals (n+3,) of a tick."""
        values = np.concatenate((e, s, n_hat))
        return self._codec.encode(self._timebase.stamp_ns(tick), values)
