"""/truth/joint_states: the joints as they truly move, and the torques truly given to them."""

from __future__ import annotations

from .. import topics
from .joint_states import JointStates


class TruthJointStates(JointStates):
    """A sensor_msgs/JointState beside the one of /joint_states, which the sensors tell."""

    topic = topics.TRUTH_JOINT_STATES
