"""What is done to flights: others that publish, processes killed, the domain taken."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator

from foreign_publisher import KINDS
from restarts import restarted
from trial import NODES, Trial, Verdict

from space_robot_msgs_py import topics

Attack = Callable[[int], list[Verdict]]
"""Carries one out in a domain."""
FLOOD_HZ = 2000.0
IN_FLIGHT = 1_000_000
"""Bytes of a bag with more than the reference that is sent in advance."""
PHASES = ("starting", "configuring", "flying", "landing")
SIGNALS = {"kill": signal.SIGKILL, "end": signal.SIGTERM, "interrupt": signal.SIGINT}


def foreign_publishers() -> Iterator[tuple[str, Attack]]:
    """On every topic every kind of message, in flight."""
    for topic in topics.ALL:
        for kind in KINDS:
            for rate in (2.0, FLOOD_HZ):
                yield (
                    f"{kind} on {topic.full_name} at {rate:g} Hz",
                    _intrusion(topic.full_name, kind, rate),
                )


def early_publishers() -> Iterator[tuple[str, Attack]]:
    """Somebody who publishes before the flight begins: it must not begin."""
    for topic in topics.ALL:
        yield f"{topic.full_name} taken before", _early(topic.full_name)


def deaths() -> Iterator[tuple[str, Attack]]:
    """Each process, ended in each way, in each phase; then another flight in the same domain."""
    for phase in PHASES:
        for victim in (*NODES, "fly"):
            for name in SIGNALS:
                if (phase, victim) != ("landing", "plant"):  # it has ended by then
                    yield f"{name} {victim} while {phase}", _death(victim, phase, name)


def pairs() -> Iterator[tuple[str, Attack]]:
    """Two flights on one domain."""
    yield "two flights at once", lambda domain: _two(domain, 0.0)
    yield "a second flight later", lambda domain: _two(domain, 4.0)


def restarts() -> Iterator[tuple[str, Attack]]:
    """Each node of a graph started by hand dies and comes back."""
    for victim in NODES:
        yield f"{victim} restarted", restarted(victim)


GROUPS: dict[str, Callable[[], Iterator[tuple[str, Attack]]]] = {
    "foreign": foreign_publishers,
    "early": early_publishers,
    "deaths": deaths,
    "pairs": pairs,
    "restarts": restarts,
}


def _flies(trial: Trial) -> bool:
    return trial.recorded_bytes() > IN_FLIGHT


def _intrusion(topic: str, kind: str, rate_hz: float) -> Attack:
    def attack(domain: int) -> list[Verdict]:
        trial = Trial(f"{kind} on {topic} at {rate_hz:g} Hz", domain, duration=6.0).start()
        if trial.wait(lambda: _flies(trial)):
            trial.publish_foreign(topic, kind, rate_hz)
        return [trial.end(must_fly=rate_hz < FLOOD_HZ)]

    return attack


def _early(topic: str) -> Attack:
    def attack(domain: int) -> list[Verdict]:
        trial = Trial(f"{topic} taken before", domain)
        trial.publish_foreign(topic, "malformed", 10.0)
        verdict = trial.start().end()
        if verdict.exit_code == 0:
            verdict.wrong.append("flew although the topic was taken")
        return [verdict]

    return attack


def _death(victim: str, phase: str, name: str) -> Attack:
    def attack(domain: int) -> list[Verdict]:
        trial = Trial(f"{name} {victim} while {phase}", domain, duration=2.0).start()

        def pid() -> int | None:
            return trial.process.pid if victim == "fly" else trial.node(victim)

        reached = {
            "starting": lambda: trial.node("plant"),
            "configuring": trial.bag.exists,
            "flying": lambda: _flies(trial),
            "landing": lambda: _flies(trial) and not trial.node("plant"),
        }[phase]
        if trial.wait(reached) and (number := pid()):
            os.kill(number, SIGNALS[name])
        verdict = trial.end(may_lose=victim == "recorder" and name == "kill")
        after = Trial(f"{verdict.name}: the next flight", domain, duration=0.1).start()
        return [verdict, after.end(must_fly=True)]

    return attack


def _two(domain: int, apart_s: float) -> list[Verdict]:
    one = Trial(f"first of two, {apart_s:g} s apart", domain, duration=3.0).start()
    time.sleep(apart_s)
    other = Trial(f"second of two, {apart_s:g} s apart", domain, duration=3.0).start()
    verdicts = [one.end(), other.end()]
    codes = sorted(verdict.exit_code or 0 for verdict in verdicts)
    if codes != [0, 2]:
        verdicts[0].wrong.append(f"exit codes {codes}: one should fly, one be refused (0, 2)")
    return verdicts
