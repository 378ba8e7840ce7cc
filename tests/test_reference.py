"""docs/reference is what docs/generate.py makes of the code, and complete."""

from __future__ import annotations

import runpy

import pytest
from paths import DOCS

from space_robot.scenario.node_settings import SCHEMAS
from space_robot_control.laws import laws
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.settings import NodeSettings, leaves

GENERATOR = runpy.run_path(str(DOCS / "generate.py"))
PAGES: dict[str, str] = GENERATOR["pages"]()


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_up_to_date(page: str) -> None:
    written = (DOCS / "reference" / page).read_text("utf-8")
    assert written == PAGES[page], "run `python docs/generate.py`"


def test_no_page_is_left_over() -> None:
    assert {path.name for path in (DOCS / "reference").iterdir()} == set(PAGES)


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.ros_name())
def test_every_parameter_is_there(schema: type[NodeSettings]) -> None:
    """Under its node, or under all nodes."""
    sections = PAGES["parameters.md"].split("\n## ")
    (section,) = (text for text in sections if text.startswith(f"{schema.ros_name()}\n"))
    (shared,) = (text for text in sections if text.startswith("All nodes\n"))
    for name, _ in leaves(schema):
        assert f"\n| `{name}` |" in section + shared, name
    assert "`autostart`" in shared


def test_every_law_and_every_topic_is_there() -> None:
    for name in laws():
        assert f"| `{name}." in PAGES["parameters.md"]
    for topic in topics.RECORDED:
        assert f"| `{topic.full_name}` | {topic.type}" in PAGES["topics.md"]
