"""Messages of one robot's topics in a bag, by namespace, remapping and type."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping

from .. import topics as graph
from ..config.text import parse_json
from ..config.validation import full_namespace, one_of
from ..errors import InputError
from .batch import Batch
from .folder import Bag, some_of
from .recorder import FLIGHT_KEY, TOPICS_KEY

REQUIRED = (graph.JOINT_STATES, graph.BASE_STATE, graph.REFERENCE_JOINTS, graph.REFERENCE_BASE)
"""Topics without which a flight cannot be read."""


class Selection:
    """The messages of our topics in a bag."""

    def __init__(self, bag: Bag, remap: Mapping[str, str], namespace: str | None = None) -> None:
        """Take the topics of one robot.

        Args:
            bag: a bag.
            remap: our name of a topic by the bag's; a topic with our name is then ignored.
            namespace: the robot's; None: that of the only one in the bag.

        Raises:
            InputError: a topic is to become one that is not ours, or two are to become the same;
                there are several robots, or none in the namespace.
        """
        self._bag, self._remap = bag, dict(remap)
        self.wrong: dict[str, str] = {}
        """Why a topic cannot be read, by our name of it."""
        for theirs, ours in self._remap.items():
            one_of(ours, graph.BY_NAME, "topic", f" to take {theirs} for")
            if list(self._remap.values()).count(ours) > 1:
                raise InputError(f"more than one topic is to be taken for {ours}")
        noted = _noted_remappings(bag.custom_data())
        taken = {n: ours for n, ours in noted.items() if ours not in self._remap.values()}
        taken |= self._remap
        is_ours = FLIGHT_KEY in bag.custom_data()
        self.namespace = find_namespace(bag, namespace, taken.values(), is_ours)
        """The robot's."""
        self._names = {
            topic.in_namespace(self.namespace): topic
            for topic in graph.ALL
            if topic.full_name not in taken.values()
        }
        self._names |= {theirs: graph.BY_NAME[ours] for theirs, ours in taken.items()}

    def batches(self) -> Iterator[tuple[graph.Topic, Batch]]:
        """Yield all messages of our topics, as they were written."""
        for batch in self._bag.batches():
            topic = self._names.get(batch.topic)
            if topic and self._fits(topic, batch.type, batch.encoding):
                yield topic, batch

    def topics(self) -> list[graph.Topic]:
        """Return our topics that the bag has with the right type, messages or none.

        Raises:
            InputError: a topic to remap is not in the bag.
        """
        kinds = self._bag.topics()
        for theirs in self._remap:
            if theirs not in kinds:
                listing = some_of(sorted(kinds)) or "no topics"
                raise InputError(f"no topic {theirs} to remap; it has {listing}")
        chosen = [
            topic
            for name, kind in kinds.items()
            if (topic := self._names.get(name)) and self._fits(topic, kind, "cdr")
        ]
        return sorted(set(chosen), key=graph.ALL.index)

    def recorded(self) -> dict[str, int] | None:
        """Return the messages that the bag should hold, by our topic; None: nobody counted."""
        counts = self._bag.recorded()
        if counts is None:
            return None
        named = ((self._names.get(name), count) for name, count in counts.items())
        return {
            topic.full_name: count
            for topic, count in named
            if topic and topic.full_name not in self.wrong
        }

    def listing_instead_of(self, topic: graph.Topic) -> str:
        """Return the topics with messages in words, those of the type of ``topic`` first."""
        kinds, counts = self._bag.topics(), self._bag.counts()
        names = [name for name in sorted(kinds) if counts.get(name)]
        names.sort(key=lambda name: not _is_type(kinds[name], topic))
        return f"it has {some_of(names)}" if names else "no topic of it has any"

    def _fits(self, topic: graph.Topic, kind: str, encoding: str) -> bool:
        if encoding != "cdr":
            self.wrong[topic.full_name] = f"encoded as {encoding!r}, 'cdr' is needed"
        elif kind and not _is_type(kind, topic):  # unknown without definitions
            self.wrong[topic.full_name] = f"of type {kind}, {topic.type} is needed"
        else:
            return True
        return False


def _is_type(kind: str, topic: graph.Topic) -> bool:
    # DDS has no /msg/ in the names of types
    return kind.replace("/msg/", "/") == topic.type.replace("/msg/", "/")


def _noted_remappings(noted: Mapping[str, str]) -> dict[str, str]:
    try:
        remappings = parse_json(noted.get(TOPICS_KEY, "{}"))
        ours = list(remappings.values())
        is_sound = len(set(ours)) == len(ours) and graph.BY_NAME.keys() >= set(ours)
    except (ValueError, AttributeError, TypeError):
        return {}
    return remappings if is_sound else {}


def find_namespace(bag: Bag, wanted: str | None, known: Collection[str], is_ours: bool) -> str:
    """Find the namespace of the robot to be read.

    Args:
        bag: it has the robot's topics by their full names.
        wanted: namespace of the one that is meant; None: the only one there is.
        known: our topics, by their full names in the root namespace, that others stand for.
        is_ours: whether our recorder wrote the bag: it declares its topics first.

    Returns:
        The root namespace if the bag has no robot: who reads it says what is missing.
    """
    needed = [topic for topic in REQUIRED if topic.full_name not in known]
    namespaces = _count_namespaces(bag.topics(), needed)
    if not is_ours and (not bag.finished or len(needed) not in namespaces.values()):
        bag.counts()  # all topics are known once all messages have been passed
        namespaces = _count_namespaces(bag.topics(), needed)
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
    if not namespaces or graph.ROOT in namespaces:
        return graph.ROOT
    return namespaces.most_common(1)[0][0]


def _count_namespaces(kinds: Mapping[str, str], needed: Collection[graph.Topic]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for name, kind in kinds.items():
        for topic in needed:
            if name.endswith(f"/{topic.name}") and (not kind or _is_type(kind, topic)):
                counts[name.removesuffix(topic.name).rstrip("/") or graph.ROOT] += 1
    return counts
