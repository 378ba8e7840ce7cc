"""The topics of ``space-robot help``: Markdown files of this folder, shown as plain text."""

from __future__ import annotations

from pathlib import Path

from space_robot_msgs_py.config.validation import one_of

FOLDER = Path(__file__).parent
ORDER = (
    "first-flight",
    "results",
    "own-robot",
    "own-trajectory",
    "own-law",
    "gains",
    "sensors",
    "disturbances",
    "campaign",
    "ros",
    "realtime",
    "install",
)
"""The topics as they are listed: a new user's path."""
TITLE, FENCE = "# ", "```"


def read_topic(name: str) -> str:
    """Return the Markdown text of a topic, as of ``own-robot``.

    Raises:
        InputError: there is no such topic.
    """
    one_of(name, ORDER, "topic")
    return (FOLDER / f"{name}.md").read_text("utf-8")


def title(text: str) -> str:
    """Return the question that a topic answers: its first line."""
    return text.split("\n", 1)[0].removeprefix(TITLE)


def as_plain_text(text: str) -> str:
    """Return a topic's text for a terminal: fenced blocks are indented, other Markdown is kept."""
    lines, is_fenced = [], False
    for line in text.rstrip().split("\n"):
        if line.startswith(FENCE):
            is_fenced = not is_fenced
        else:
            lines.append(f"    {line}" if is_fenced and line else line.removeprefix(TITLE))
    return "\n".join(lines)
