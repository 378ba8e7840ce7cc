"""Names and number of the base's actuators and of motors behind gears, from a bag's messages."""

from __future__ import annotations

from .. import topics
from ..errors import MessageError
from ..samples import (
    ACTUATOR_FIELDS,
    MOST_GEARS,
    MOST_THRUSTERS,
    MOST_TORQUERS,
    MOST_WHEELS,
    RobotNames,
    Timebase,
)
from ..wire.definitions import decode
from ..wire.messages import MessageDescription, describe
from .batch import Batch

MOST_ACTUATORS = {
    topics.WHEELS_STATE: MOST_WHEELS,
    topics.THRUSTERS_STATE: MOST_THRUSTERS,
    topics.MOTORS_STATE: MOST_GEARS,
    topics.COMMAND: MOST_WHEELS + MOST_THRUSTERS + MOST_TORQUERS,
}
"""Topics whose messages name actuators, and the largest number of each."""
ACTUATOR_COLUMNS = (*ACTUATOR_FIELDS, "actuator_commands")
"""Columns of a log with one value per actuator."""


def names_in(topic: topics.Topic, batch: Batch, joints: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the actuators' names from the first message with them, or None."""
    for i in range(len(batch)):
        try:
            names = tuple(decode(batch.message(i), topic.type).name)
        except MessageError:
            continue
        if topic is not topics.COMMAND:
            return names
        axes = RobotNames(joints).axes
        if set(axes) <= set(names):
            return tuple(name for name in names if name not in axes)
    return None


def described(
    topic: topics.Topic, names: tuple[str, ...], joints: tuple[str, ...], timebase: Timebase
) -> MessageDescription | None:
    """Describe the messages of a topic for actuators of these names; None: invalid names."""
    if not 0 < len(names) <= MOST_ACTUATORS[topic]:
        return None
    robot = RobotNames(joints)
    if topic is topics.MOTORS_STATE and not set(names) <= set(joints):
        return None
    if topic is topics.THRUSTERS_STATE:
        robot = robot._replace(thrusters=names)
    elif topic is topics.MOTORS_STATE:
        robot = robot._replace(geared=names)
    else:
        robot = robot._replace(wheels=names)
    return describe(topic, robot, timebase)
