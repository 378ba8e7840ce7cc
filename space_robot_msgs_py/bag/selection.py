"""The messages of a bag that are ours: by topic, in a namespace or remapped, of the right type."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .. import topics as graph
from ..config.validation import one_of
from ..errors import InputError
from .batch import Batch
from .contents import Bag
from .findings import some_of
from .recorder import FLIGHT_KEY
from .remappings import noted_remappings
from .robots import find_namespace, is_type


class Selection:
    """The messages of our topics in a bag."""

    def __init__(self, bag: Bag, remap: Mapping[str, str], namespace: str | None = None) -> None:
        """Take the topics of one robot.

        Args:
            bag: a bag.
            remap: our topic by theirs; it then stands for ours, even if the bag has ours too.
            namespace: the robot's; None: that of the only one in the bag.

        Raises:
            InputError: a topic is to become one that is not ours, or two are to become the same;
                there are several robots, or none in the namespace.
        """
        self._bag, self._remap = bag, dict(remap)
        self.wrong: dict[str, str] = {}
        """The finding instead of the right type, by our topic."""
        for theirs, ours in self._remap.items():
            one_of(ours, graph.BY_NAME, "topic", f" to take {theirs} for")
            if list(self._remap.values()).count(ours) > 1:
                raise InputError(f"more than one topic is to be taken for {ours}")
        noted = noted_remappings(bag.custom_data())
        taken = {n: ours for n, ours in noted.items() if ours not in self._remap.values()}
        taken |= self._remap
        is_ours = FLIGHT_KEY in bag.custom_data()
        self.namespace = find_namespace(bag, namespace, taken.values(), is_ours)
        """The robot's."""
        self._names = {topic.in_namespace(self.namespace): topic for topic in graph.ALL}
        for name, topic in list(self._names.items()):
            if topic.full_name in taken.values():
                del self._names[name]
        self._names |= {theirs: graph.BY_NAME[ours] for theirs, ours in taken.items()}

    def batches(self) -> Iterator[tuple[graph.Topic, Batch]]:
        """All messages of our topics, as they were written."""
        for batch in self._bag.batches():
            topic = self.ours(batch.topic)
            if topic and self._fits(topic, batch.type, batch.encoding):
                yield topic, batch

    def ours(self, name: str) -> graph.Topic | None:
        """Our topic that a topic of the bag is taken for."""
        return self._names.get(name)

    def topics(self) -> list[graph.Topic]:
        """Our topics that the bag has with the right type, messages or none.

        Raises:
            InputError: a topic to remap is not in the bag.
        """
        there = self._bag.topics()
        for theirs in self._remap:
            if theirs not in there:
                raise InputError(f"no topic {theirs} to remap; it has {self.listing()}")
        chosen = [
            topic
            for name, kind in there.items()
            if (topic := self.ours(name)) and self._fits(topic, kind, "cdr")
        ]
        return sorted(set(chosen), key=graph.ALL.index)

    def recorded(self) -> dict[str, int] | None:
        """Messages that the bag should hold, by our topic; None: nobody counted."""
        counts = self._bag.recorded()
        if counts is None:
            return None
        named = ((self.ours(name), count) for name, count in counts.items())
        return {
            topic.full_name: count
            for topic, count in named
            if topic and topic.full_name not in self.wrong
        }

    def listing(self) -> str:
        """The bag's topics in words."""
        return some_of(sorted(self._bag.topics())) or "no topics"

    def listing_instead_of(self, topic: graph.Topic) -> str:
        """The topics with messages in words, those first that may be the one that is looked for."""
        kinds, counts = self._bag.topics(), self._bag.counts()
        names = [name for name in sorted(kinds) if counts.get(name)]
        names.sort(key=lambda name: not is_type(kinds[name], topic))
        return f"it has {some_of(names)}" if names else "no topic of it has any"

    def _fits(self, topic: graph.Topic, kind: str, encoding: str) -> bool:
        if encoding != "cdr":
            self.wrong[topic.full_name] = f"encoded as {encoding!r}, 'cdr' is needed"
        elif kind and not is_type(kind, topic):
            self.wrong[topic.full_name] = f"of type {kind}, {topic.type} is needed"
        else:
            return True
        return False
