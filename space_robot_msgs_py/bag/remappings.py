"""Topics that were recorded under other names than their own: what our recorder noted of them."""

from __future__ import annotations

import json
from collections.abc import Mapping

from .. import topics

TOPICS_KEY = "space_robot.topics"


def remappings_note(names: Mapping[str, str], namespace: str) -> dict[str, str]:
    """What goes into a bag's custom data; nothing where no topic was remapped.

    Args:
        names: full name of each topic, as it was recorded, by ours.
        namespace: the recorder's.
    """
    found = {
        name: topic.full_name
        for topic in topics.ALL
        if (name := names[topic.name]) != topic.in_namespace(namespace)
    }
    return {TOPICS_KEY: json.dumps(found)} if found else {}


def noted_remappings(noted: Mapping[str, str]) -> dict[str, str]:
    """Our topic by the one that it was recorded as; empty if nothing that makes sense is noted."""
    try:
        found = json.loads(noted.get(TOPICS_KEY, "{}"))
    except (ValueError, RecursionError):
        return {}
    if not isinstance(found, dict) or not all(isinstance(ours, str) for ours in found.values()):
        return {}
    if len(set(found.values())) < len(found) or not topics.BY_NAME.keys() >= set(found.values()):
        return {}
    return found
