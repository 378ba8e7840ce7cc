"""The publishers of a topic: the graph's own, and foreign ones.

A topic of the graph has one publisher. Its node has claimed the topic and noted its publisher's
identity there, so it is told from others without asking anybody's name, from its first message on;
one that was started again has claimed the topic anew. Each publisher counts what it sends, so
what it sent and did not come here is known whatever the stamps say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

PARTICIPANT_BYTES = 12
"""The first bytes of a publisher's GID, which name the participant, so the process."""


class Claimed(NamedTuple):
    """The claim on a topic."""

    publishers: tuple[bytes, ...] = ()
    """The GIDs noted last, the newest last, of nodes that may have ended since."""
    is_held: bool = False
    """True if that node still lives."""


class Publishers(Protocol):
    """Finds out about the publishers of a topic, without their messages."""

    def claimed(self, topic: str) -> Claimed:
        """Return who has claimed it."""

    def names(self, topic: str) -> Mapping[bytes, str]:
        """Full node name by GID of all that are listed now; empty of one without a name."""


class Unknown:
    """Sources that cannot be identified: every publisher is accepted as the flight's own."""

    def claimed(self, topic: str) -> Claimed:
        """Nobody has."""
        return Claimed()

    def names(self, topic: str) -> Mapping[bytes, str]:
        """None is listed."""
        return {}


@dataclass(slots=True)
class Source:
    """One publisher's messages, counted."""

    is_ours: bool
    is_claimed: bool
    received: int = 0
    last: int = 0
    """The highest sequence number."""
    passed_over: int = 0
    """Messages sent while nothing was to be recorded."""
    reported: int = 0
    """Messages that were sent, by their sender's own account."""
    is_resuming: bool = False
    name: str = ""

    def take(self, sequence: int) -> None:
        """Count a message."""
        if self.is_resuming:
            self.is_resuming = False
            self.passed_over += max(0, sequence - self.last - 1)
        self.received += 1
        self.last = max(self.last, sequence)

    @property
    def holes(self) -> int:
        """Messages that were sent before the last one here and are not here."""
        return max(0, self.last - self.received - self.passed_over)

    @property
    def tail(self) -> int:
        """Messages that were sent after the last one here."""
        return 0 if self.is_resuming else max(0, self.reported - self.last)


class Sources:
    """The publishers of one topic. Independent of ROS."""

    def __init__(self, topic: str, publishers: Publishers) -> None:
        self._topic, self._publishers = topic, publishers
        self._sources: dict[bytes, Source] = {}
        self._was_claimed = self._has_paused = False
        self.is_counted = False
        """True if our publisher tells how many messages it sent."""
        self.begins_anew = False
        """True if what was recorded so far turned out to be a foreign publisher's."""

    def take(self, publisher: bytes, sequence: int) -> bool:
        """Count a message; whether it is ours.

        Args:
            publisher: GID; empty where messages tell none: then all are taken for ours.
            sequence: number of the message of its publisher, from 1 on; 0: unknown.
        """
        if not publisher:
            return True
        source = self._sources.get(publisher) or self._meet(publisher)
        source.take(sequence)
        if source.is_ours and sequence:
            self.is_counted = True
        return source.is_ours

    def note_sent(self, participant: bytes, count: int) -> None:
        """Our publisher of this participant says that it has sent ``count`` messages.

        Of no use where messages tell no publisher (empty).
        """
        if not participant:
            return
        ours = [p for p, s in self._sources.items() if s.is_ours]
        same = [p for p in ours if p[:PARTICIPANT_BYTES] == participant]
        if not same and count:
            claimed = self._publishers.claimed(self._topic).publishers
            same = [p for p in claimed if p[:PARTICIPANT_BYTES] == participant]
        if same:  # of several the newest: a node that was configured again counts anew
            source = self._sources.get(same[-1]) or self._meet(same[-1])
            source.reported = max(source.reported, count)
            self.is_counted = True

    def pause(self) -> None:
        """Pass over what each publisher sends until its next message here."""
        self._has_paused = True
        for source in self._sources.values():
            source.is_resuming = True

    def find_names(self) -> None:
        """Look for names of foreign publishers that have none yet."""
        nameless = {p: s for p, s in self._sources.items() if not (s.is_ours or s.name)}
        names = self._publishers.names(self._topic) if nameless else {}
        for publisher, source in nameless.items():
            source.name = names.get(publisher, "")

    @property
    def holes(self) -> int:
        """Messages that our publishers sent before the last one here and that are not here."""
        return sum(source.holes for source in self._sources.values() if source.is_ours)

    @property
    def tail(self) -> int:
        """Messages that our publishers sent after the last one here."""
        return sum(source.tail for source in self._sources.values() if source.is_ours)

    @property
    def is_behind(self) -> bool:
        """True if our publishers say that they have sent more than has come."""
        return self.tail > 0

    @property
    def passed_over(self) -> int:
        """Messages of our publishers that were sent while nothing was to be recorded."""
        return sum(source.passed_over for source in self._sources.values() if source.is_ours)

    @property
    def foreign(self) -> int:
        """Messages of foreign publishers."""
        return sum(source.received for source in self._sources.values() if not source.is_ours)

    @property
    def foreign_names(self) -> list[str]:
        """Their nodes, or how many have no name."""
        foreign = [source.name for source in self._sources.values() if not source.is_ours]
        names = sorted({name for name in foreign if name})
        if nameless := foreign.count(""):
            names.append(f"{nameless} publisher{'s' if nameless > 1 else ''} without a name")
        return names

    def _meet(self, publisher: bytes) -> Source:
        claim = self._publishers.claimed(self._topic)
        self._was_claimed = self._was_claimed or claim.is_held or publisher in claim.publishers
        if is_claimed := publisher in claim.publishers:
            for other in self._sources.values():
                if other.is_ours and not other.is_claimed:  # it was there first, but is foreign
                    other.is_ours, self.begins_anew = False, True
        is_ours = is_claimed or (not self._was_claimed and self._follows(publisher))
        source = Source(is_ours, is_claimed, is_resuming=self._has_paused)
        self._sources[publisher] = source
        return source

    def _follows(self, publisher: bytes) -> bool:
        """Return True for the first publisher of an unclaimed topic, or its restart."""
        ours = [p for p, source in self._sources.items() if source.is_ours]
        if not ours:
            return True
        names = self._publishers.names(self._topic)
        known = {names[p] for p in ours if p in names}
        return not known or names.get(publisher, "") in known - {""}
