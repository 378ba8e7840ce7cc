"""Identification of a topic's publishers: the graph's own, and foreign ones.

A topic of the graph has one publisher. Its node has claimed the topic with the publisher's identity
(GID), so its messages are recognised from the first one on, without discovery; a restarted node
claims the topic again. Each publisher counts its messages, so lost messages are detected
independently of the stamps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

PARTICIPANT_BYTES = 12
"""Number of first bytes of a GID that identify the participant, hence the process."""


class Claimed(NamedTuple):
    """Claim on a topic."""

    publishers: tuple[bytes, ...] = ()
    """GIDs of the last claims, the newest last; their nodes may have ended."""
    is_held: bool = False
    """True if the node of the newest claim is alive."""


class Publishers(Protocol):
    """Information on the publishers of a topic, independent of their messages."""

    def claimed(self, topic: str) -> Claimed:
        """Return the claim on a topic."""

    def names(self, topic: str) -> Mapping[bytes, str]:
        """Return the full node name of each discovered publisher by GID; empty if unknown."""


class Unknown:
    """Publishers that cannot be identified: all are accepted as the graph's own."""

    def claimed(self, topic: str) -> Claimed:
        """Return an empty claim."""
        return Claimed()

    def names(self, topic: str) -> Mapping[bytes, str]:
        """Return no names."""
        return {}


@dataclass(slots=True)
class Source:
    """Counts the messages of one publisher."""

    is_ours: bool
    is_claimed: bool
    received: int = 0
    last: int = 0
    """Highest sequence number."""
    passed_over: int = 0
    """Number of messages sent while recording was paused."""
    reported: int = 0
    """Number of sent messages, as reported by the sender."""
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
        """Number of messages that were sent before the last received one and are missing."""
        return max(0, self.last - self.received - self.passed_over)

    @property
    def tail(self) -> int:
        """Number of messages that were sent after the last received one."""
        return 0 if self.is_resuming else max(0, self.reported - self.last)


class Sources:
    """Identifies and counts the publishers of one topic; independent of ROS."""

    def __init__(self, topic: str, publishers: Publishers) -> None:
        self._topic, self._publishers = topic, publishers
        self._sources: dict[bytes, Source] = {}
        self._was_claimed = self._has_paused = False
        self.is_counted = False
        """True if our publisher reports its number of sent messages."""
        self.begins_anew = False
        """True if already recorded messages are those of a foreign publisher."""

    def take(self, publisher: bytes, sequence: int) -> bool:
        """Count a message; return True if it is ours.

        Args:
            publisher: GID; empty if unknown: then all messages count as ours.
            sequence: the publisher's number of the message, from 1; 0: unknown.
        """
        if not publisher:
            return True
        source = self._sources.get(publisher) or self._meet(publisher)
        source.take(sequence)
        if source.is_ours and sequence:
            self.is_counted = True
        return source.is_ours

    def note_sent(self, participant: bytes, count: int) -> None:
        """Store the number of sent messages reported by our publisher.

        Args:
            participant: of the publisher; empty if unknown: then the report is ignored.
            count: number of sent messages.
        """
        if not participant:
            return
        ours = [p for p, s in self._sources.items() if s.is_ours]
        same = [p for p in ours if p[:PARTICIPANT_BYTES] == participant]
        if not same and count:
            claimed = self._publishers.claimed(self._topic).publishers
            same = [p for p in claimed if p[:PARTICIPANT_BYTES] == participant]
        if same:  # the newest of several: a reconfigured node restarts its count
            source = self._sources.get(same[-1]) or self._meet(same[-1])
            source.reported = max(source.reported, count)
            self.is_counted = True

    def pause(self) -> None:
        """Ignore the messages of each publisher until its next received one."""
        self._has_paused = True
        for source in self._sources.values():
            source.is_resuming = True

    def find_names(self) -> None:
        """Look up the names of foreign publishers that are still unknown."""
        nameless = {p: s for p, s in self._sources.items() if not (s.is_ours or s.name)}
        names = self._publishers.names(self._topic) if nameless else {}
        for publisher, source in nameless.items():
            source.name = names.get(publisher, "")

    @property
    def holes(self) -> int:
        """Number of missing messages of our publishers before the last received ones."""
        return sum(source.holes for source in self._sources.values() if source.is_ours)

    @property
    def tail(self) -> int:
        """Number of messages that our publishers sent after the last received ones."""
        return sum(source.tail for source in self._sources.values() if source.is_ours)

    @property
    def is_behind(self) -> bool:
        """True if our publishers report more messages than were received."""
        return self.tail > 0

    @property
    def passed_over(self) -> int:
        """Number of messages of our publishers sent while recording was paused."""
        return sum(source.passed_over for source in self._sources.values() if source.is_ours)

    @property
    def foreign(self) -> int:
        """Number of messages of foreign publishers."""
        return sum(source.received for source in self._sources.values() if not source.is_ours)

    @property
    def foreign_names(self) -> list[str]:
        """Node names of foreign publishers, and the number of those without name."""
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
                if other.is_ours and not other.is_claimed:  # it was first, but is foreign
                    other.is_ours, self.begins_anew = False, True
        is_ours = is_claimed or (not self._was_claimed and self._follows(publisher))
        source = Source(is_ours, is_claimed, is_resuming=self._has_paused)
        self._sources[publisher] = source
        return source

    def _follows(self, publisher: bytes) -> bool:
        """Return True for the first publisher of an unclaimed topic, or its restarted node."""
        ours = [p for p, source in self._sources.items() if source.is_ours]
        if not ours:
            return True
        names = self._publishers.names(self._topic)
        known = {names[p] for p in ours if p in names}
        return not known or names.get(publisher, "") in known - {""}
