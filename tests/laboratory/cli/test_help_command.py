"""The command help: topics of one screen, which lead on to pages that exist."""

from __future__ import annotations

import re

import pytest
from command import Run
from pages import TOPICS, items
from paths import ROOT

from space_robot.cli.main import cli
from space_robot.help.topics import ORDER, as_plain_text, read_topic, title

MOST_LINES, MOST_COLUMNS = 25, 100


def anchors(page: str) -> set[str]:
    """Of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", (ROOT / page).read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


def test_every_file_is_listed(space_robot: Run) -> None:
    assert sorted(ORDER) == [file.stem for file in TOPICS]
    code, out, _ = space_robot("help")
    assert code == 0
    for name in ORDER:
        assert re.search(rf"^{name} +{re.escape(title(read_topic(name)))}$", out, re.MULTILINE)


@pytest.mark.parametrize("name", ORDER)
def test_a_topic_fits_a_screen_and_leads_on(name: str, space_robot: Run) -> None:
    """Its commands are run by test_pages.py."""
    code, out, err = space_robot("help", name)
    assert (code, err) == (0, "")
    lines = out.rstrip("\n").split("\n")
    assert lines[0] == title(read_topic(name))
    assert lines[0].endswith("?")
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= MOST_COLUMNS
    assert "```" not in out
    pages = re.findall(r"docs/[\w/.#-]+", lines[-1])
    assert lines[-1].startswith("More: ")
    assert pages
    for page, _, anchor in (page.partition("#") for page in pages):
        assert (ROOT / page).is_file()
        assert not anchor or anchor in anchors(page)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda file: file.stem)
def test_a_topic_has_commands(topic: object) -> None:
    (file,) = [file for file in TOPICS if file == topic]
    assert any(item.text.startswith("space-robot ") for item in items(file))


def test_an_unknown_topic_is_refused_with_the_nearest(space_robot: Run) -> None:
    code, out, err = space_robot("help", "own-robt")
    assert (code, out) == (2, "")
    assert err.startswith("space-robot: error: unknown topic 'own-robt': choose one of first-fl")
    assert err.endswith("install (did you mean own-robot?)\n")


def test_a_command_for_a_topic_shows_its_help(space_robot: Run) -> None:
    """Unless a topic has its name."""
    shown = space_robot("help", "simulate").out
    assert shown.startswith("Usage: space-robot simulate [OPTIONS]")
    assert shown == space_robot("simulate", "--help").out
    assert {"gains", "campaign"} <= {*ORDER} & {*cli.commands}
    assert space_robot("help", "gains").out.startswith(title(read_topic("gains")))


def test_fenced_blocks_are_indented() -> None:
    text = "# A?\n\n```yaml\n# a.yaml\n\na: 1\n```\n\nEnd\n"
    assert as_plain_text(text) == "A?\n\n    # a.yaml\n\n    a: 1\n\nEnd"
