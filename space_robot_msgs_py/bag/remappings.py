"""Topics that were recorded under other names than their own: what our recorder noted of them."""

from __future__ import annotations

import json
from collections.abc import Mapping

from .. import topics
from ..config.text import parse_json

TOPICS_KEY = "space_robot.topics"


def remappings_note(names: Mapping[str, str], namespace: str) -> dict[str, str]:
    """What goes into a bag's custom data; nothing where no topic was remapped.

    Args:
        names: full name of each topic, as it was recorded, by ours.
        namespace: the recorder's.
    """
    note = {
        name: topic.full_name
        for topic in topics.ALL
        if (name := names[topic.name]) != topic.in_namespace(namespace)
    }
    return {TOPICS_KEY: json.dumps(note)} if note else {}


def noted_remappings(noted: Mapping[str, str]) -> dict[str, str]:
    """Our topic by the one that it was recorded as; empty if nothing that makes sense is noted."""
    try:
        remappings = parse_json(noted.get(TOPICS_KEY, "{}"))
    except ValueError:
        return {}
    if not isinstance(remappings, dict) or not all(
        isinstance(ours, str) for ours in remappings.values()
    ):
        return {}
    if len(set(remappings.values())) < len(remappings) or not topics.BY_NAME.keys() >= set(
        remappings.values()
    ):
        return {}
    return remappings
