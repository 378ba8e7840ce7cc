"""The messages of a topic that come from the publisher that is followed."""

from __future__ import annotations

from collections.abc import Callable

SILENCE_NS = 800_000_000
"""A publisher that is silent for longer may be replaced. A node that waits for an answer asks again
before that."""
MOST_OTHERS = 8
DOUBTS = 5
"""So many messages in a row that make no sense, and a publisher is followed no longer."""
UNSUPPORTED = 2**64 - 1
"""Sequence number of a middleware that counts none: then no publisher can be told from another."""


class SourceGuard:
    """Lets messages pass that the followed publisher has sent. Knows no ROS.

    A message does not tell its publisher, but its sequence number counts that publisher's messages.
    Nobody is followed until `follow` says that a message was good; until then, and while the
    followed publisher is silent, everybody's messages pass. Where two publishers have come to the
    same number a message passes too, and only `follow` tells whose it was.
    """

    def __init__(self) -> None:
        self.others_messages = 0
        """Messages of others that came while somebody was followed."""
        self.is_sure = False
        """True if the message that passed last came from the followed publisher without doubt, or
        was good and made it so."""
        self._next = 0
        """The followed publisher's next number; 0: nobody is followed."""
        self._heard_ns = 0
        self.passed = 0, 0
        """The message that passed last, for `follow`, unless that is sure. To be set by those who
        put messages aside."""
        self._contested = False
        self._begin = 0
        """The followed publisher's first number that passed."""
        self._others: dict[int, int] = {}
        """The others' next numbers, and the first of those without a gap before that; those heard
        last at the end."""
        self._doubts = 0

    @property
    def is_followed(self) -> bool:
        """True if a publisher is followed."""
        return self._next > 0

    @property
    def is_contested(self) -> bool:
        """True if it may be the followed publisher's or another's, by its number."""
        return self._contested and not self.is_sure

    def has_sent(self, sequence: int) -> bool:
        """Tell if a message that passed, maybe before its publisher was followed, is of that."""
        return self._begin <= sequence < self._next

    def passes(
        self, sequence: int, received_ns: int, is_only: Callable[[], bool] = lambda: False
    ) -> bool:
        """Tell if a message is to be looked at, by its sequence number and when it was received.

        ``is_only`` tells if the topic has no second publisher now: then one that does not fit comes
        behind a gap.
        """
        if sequence == self._next and sequence not in self._others:
            self._next = sequence + 1
            self._heard_ns = received_ns
            self.is_sure = True
            return True
        return self._passes_unsure(sequence, received_ns, is_only)

    def _passes_unsure(self, sequence: int, received_ns: int, is_only: Callable[[], bool]) -> bool:
        begin = self._others.pop(sequence, sequence)
        if len(self._others) == MOST_OTHERS:
            del self._others[next(iter(self._others))]
        self._others[sequence + 1] = begin
        is_contested = sequence == self._next
        is_silent = received_ns - self._heard_ns > SILENCE_NS
        is_expected = is_contested or is_silent or sequence == UNSUPPORTED
        if self._next and not is_expected and not is_only():
            self.others_messages += 1
            return False
        self.is_sure, self._contested = False, is_contested
        self.passed = sequence, received_ns
        return True

    def follow(self) -> None:
        """The message that passed last was good: its publisher is the one to follow.

        If that was put aside, what the publisher has sent since has passed already.
        """
        self._doubts = 0
        if not self.is_sure:
            sequence, self._heard_ns = self.passed
            runs = self._others.items()
            self._next = min(
                (stop for stop, begin in runs if begin <= sequence < stop), default=sequence + 1
            )
            self._begin = self._others.pop(self._next, sequence)
            self.is_sure = True

    def doubt(self) -> None:
        """The message that passed last made no sense."""
        self._doubts += 1
        if self._doubts == DOUBTS:
            self._next = self._doubts = 0
