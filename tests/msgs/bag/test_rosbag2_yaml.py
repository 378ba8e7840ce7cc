"""The YAML of rosbag2, against a file of the real one."""

from __future__ import annotations

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import DATA

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.rosbag2_yaml import FileSummary, bag_information, to_yaml

SAMPLE = DATA / "rosbag2_sample" / "metadata.yaml"
SPANS = st.none() | st.tuples(st.integers(0, 10**12), st.integers(0, 10**12)).map(
    lambda span: (span[0], span[0] + span[1])
)
FILES = st.lists(st.builds(FileSummary, st.just("a"), SPANS, st.integers(0, 10**6)), min_size=1)


def test_text_is_what_rosbag2_writes() -> None:
    """Indents, quotes, the null: byte for byte."""
    text = SAMPLE.read_text()
    assert to_yaml(yaml.safe_load(text)) == text.rstrip("\n")


@given(st.dictionaries(st.text(), st.text()))
def test_any_custom_data_comes_back(custom: dict[str, str]) -> None:
    given = {key: json.dumps({key: value}) for key, value in custom.items()}
    information = bag_information([FileSummary("a", None, 0)], [], given)
    assert (yaml.safe_load(to_yaml(information))["custom_data"] or {}) == given


@given(FILES)
def test_bag_spans_its_files(files: list[FileSummary]) -> None:
    information = bag_information(files, [(topics.CLOCK, 1)], {})
    start = information["starting_time"]["nanoseconds_since_epoch"]
    end = start + information["duration"]["nanoseconds"]
    assert information["message_count"] == sum(file.message_count for file in files)
    spans = [file.span_ns for file in files if file.span_ns]
    if spans:
        assert (start, end) == (min(s[0] for s in spans), max(s[1] for s in spans))
    else:
        assert (start, end) == (2**63 - 1, 2**63 - 1)  # as rosbag2 says of an empty bag


@pytest.mark.parametrize("filling", ["0.5, ", "it's, ", "é", "\n", ": # "])
def test_long_texts_are_written_as_short_ones(filling: str) -> None:
    """As PyYAML would write them, which takes long."""
    text = "{" + filling * 10_000
    value = {"a": [text, "b"], "c": text}
    written = to_yaml(value)
    assert yaml.safe_load(written) == value
    if text.isprintable():  # no line of it is indented
        plain = yaml.safe_dump(value, width=10**9).strip()
        assert written == plain.replace("\n- ", "\n  - ")
