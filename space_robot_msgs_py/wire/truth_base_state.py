"""/truth/base_state: the base as it truly moves, and the torque truly given to it."""

from __future__ import annotations

from .. import topics
from .base_state import BaseState


class TruthBaseState(BaseState):
    """A sensor_msgs/MultiDOFJointState beside the one of /base/state, which the sensors tell."""

    topic = topics.TRUTH_BASE_STATE
