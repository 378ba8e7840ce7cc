"""The notebooks run from top to bottom, and print what they show."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest
from paths import DOCS
from shown import differences

sys.path.insert(0, str(DOCS / "notebooks"))
from execute import NOTEBOOKS, executed


def texts(notebook: Any) -> Iterator[tuple[int, str]]:
    """What each cell prints, and shows as text; of a picture, that it is one.

    How many messages a cell's print is sent in is a matter of time, and nothing to compare.
    """
    for number, cell in enumerate(notebook.cells):
        outputs = cell.get("outputs", ())
        streams = [output for output in outputs if output.output_type == "stream"]
        assert all(stream.name == "stdout" for stream in streams), streams
        if streams:
            yield number, "".join(stream.text for stream in streams)
        for output in outputs:
            if output.output_type == "stream":
                continue
            if "image/png" in output.data:
                yield number, "a picture"
            else:
                yield number, output.data["text/plain"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_prints_what_it_shows(path: Path) -> None:
    shown, now = ([*texts(notebook)] for notebook in (nbformat.read(path, 4), executed(path)))
    assert sum(text == "a picture" for _, text in now) >= 4
    assert [number for number, _ in shown] == [number for number, _ in now]
    for (number, ours), (_, theirs) in zip(shown, now, strict=True):
        found = [*differences(ours.splitlines(), theirs.splitlines())]
        assert not found, f"cell {number}:\n" + "\n".join(found)
