"""Robots in a bag, distinguished by the namespaces of their topics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping

from .. import topics
from ..config.validation import full_namespace
from ..errors import InputError
from .contents import Bag
from .findings import some_of

REQUIRED = (topics.JOINT_STATES, topics.BASE_STATE, topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
"""Topics that a flight cannot be read without."""


def is_type(kind: str, topic: topics.Topic) -> bool:
    """Return True if a topic's type in a bag is ours, in ROS's or in DDS' spelling."""
    return kind.replace("/msg/", "/") == topic.type.replace("/msg/", "/")


def find_namespace(bag: Bag, wanted: str | None, known: Collection[str], is_ours: bool) -> str:
    """Find the namespace of the robot to be read.

    Args:
        bag: it has the robot's topics by their full names.
        wanted: namespace of the one that is meant; None: the only one there is.
        known: our topics, by their full names in the root namespace, that others stand for.
        is_ours: whether our recorder wrote the bag: it declares its topics first.

    Returns:
        The root namespace if the bag has no robot: who reads it says what is missing.

    Raises:
        InputError: it has several robots, or none in the namespace that is wanted.
    """
    needed = [topic for topic in REQUIRED if topic.full_name not in known]
    namespaces = _found(bag.topics(), needed)
    if not is_ours and (not bag.finished or len(needed) not in namespaces.values()):
        bag.counts()  # all topics are known once all messages have been passed
        namespaces = _found(bag.topics(), needed)
    whole = sorted(name for name, count in namespaces.items() if count == len(needed))
    if wanted is not None:
        namespace = full_namespace(wanted)
        if namespaces and namespace not in namespaces:
            raise InputError(
                f"no robot in namespace {namespace}; it has {some_of(sorted(namespaces))}"
            )
        return namespace
    if len(whole) > 1:
        raise InputError(
            f"robots of {len(whole)} namespaces, {some_of(whole)}: choose one (--namespace)"
        )
    if whole:
        return whole[0]
    return (
        topics.ROOT
        if not namespaces or topics.ROOT in namespaces
        else namespaces.most_common(1)[0][0]
    )


def _found(there: Mapping[str, str], needed: Collection[topics.Topic]) -> Counter[str]:
    """Count by namespace the needed topics that are in a bag (type by full name)."""
    counts: Counter[str] = Counter()
    for name, kind in there.items():
        for topic in needed:
            if name.endswith(f"/{topic.name}") and (not kind or is_type(kind, topic)):
                counts[name.removesuffix(topic.name).rstrip("/") or topics.ROOT] += 1
    return counts
