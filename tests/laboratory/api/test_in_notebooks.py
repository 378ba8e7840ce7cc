"""In a notebook everything shows itself: progress as one output, a flight as a page in 3-D."""

from __future__ import annotations

import html
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from paths import DOCS

pytest.importorskip("ipykernel")
nbformat = pytest.importorskip("nbformat")

CELLS = (
    "import space_robot as sr\nscenario = sr.Scenario(case='3', duration=0.5, seed=7)\nscenario",
    "flight = scenario.fly(progress=True)\nflight",
    "flights = sr.fly_many([scenario, scenario.replace(seed=8)], progress=True)",
    "from space_robot.console.progress import flight_progress\n"
    "with flight_progress(100.0, 'long') as show:\n"
    "    for k in range(10_001):\n"
    "        show(0.01 * k)\n"
    "    show.say('a remark')",
    "flight.view(rate=2.0)",
    "sr.Campaign.load('first')",
    "from space_robot_model.robot.find import find_robot\nfind_robot('dual_arm')",
)
LARGEST = 2.5e6
"""Bytes of an output: Jupyter's server passes on 1e6 a second, measured over 3 s."""


class Frame(HTMLParser):
    """The document in the frame of an output."""

    def __init__(self, output: str) -> None:
        super().__init__()
        self.document = ""
        self.feed(output)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "iframe":
            self.document = dict(attrs)["srcdoc"] or ""


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> list[list[Any]]:
    """The outputs of each cell."""
    sys.path.insert(0, str(DOCS / "notebooks"))
    from execute import executed

    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS],
        metadata={"language_info": {"name": "python", "version": ""}},
    )
    file: Path = tmp_path_factory.mktemp("notebook") / "own.ipynb"
    nbformat.write(notebook, file)
    return [cell.outputs for cell in executed(file).cells]


def html_of(outputs: list[Any]) -> str:
    """The HTML of a cell with one output."""
    (output,) = outputs
    return str(output.data["text/html"])


def test_a_scenario_shows_what_differs_from_its_defaults(outputs: list[list[Any]]) -> None:
    shown = html_of(outputs[0])
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in shown.split("<tr>")[2:]]
    assert rows == [
        ["case", "3", "1"],
        ["duration", "0.5", "the mission&#x27;s"],
        ["seed", "7", "0"],
    ]


def test_the_progress_of_a_flight_is_one_output(outputs: list[list[Any]]) -> None:
    progress, flight = outputs[1]
    assert "tde_stc" in progress.data["text/plain"]
    assert "0.5/0.5 s simulated" in progress.data["text/plain"]
    assert '<progress value="0.5" max="0.5">' in progress.data["text/html"]
    assert "complete" in flight.data["text/html"]


def test_the_progress_of_many_flights_is_one_output(outputs: list[list[Any]]) -> None:
    (progress,) = outputs[2]
    assert "2/2" in progress.data["text/plain"]


def test_ten_thousand_steps_are_no_more_outputs_than_one(outputs: list[list[Any]]) -> None:
    """And what is said meanwhile is a line of text."""
    progress, said = outputs[3]
    assert "100.0/100.0" in progress.data["text/plain"]
    assert (said.name, said.text) == ("stderr", "a remark\n")


def test_a_page_in_a_cell_is_small_and_needs_no_network(outputs: list[list[Any]]) -> None:
    bar, page = outputs[4]
    shown = page.data["text/html"]
    assert bar.data["text/html"] == ""
    assert len(shown.encode()) < LARGEST
    document = Frame(shown).document
    assert "<title>tde_stc</title>" in document
    addresses = re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', document)
    assert not addresses
    scene = re.search(r'srcdoc="([^"]*)"', document)
    assert scene
    assert "__VISER_EMBED_DATA__" in html.unescape(scene[1])


def test_a_campaign_shows_variables_requirements_and_flights(outputs: list[list[Any]]) -> None:
    shown = html_of(outputs[5])
    assert "tde_stc, ctc, 20 runs, 40 flights" in shown
    assert "{normal: 1.0, relative: true, sigma: 0.05}" in shown
    assert "attitude_max below 0.001 in 90 % of the cases, with 90 % confidence" in shown


def test_a_robot_shows_bodies_joints_and_limits(outputs: list[list[Any]]) -> None:
    from space_robot_model.robot.find import find_robot

    robot, shown = find_robot("dual_arm"), html_of(outputs[6])
    assert f"{float(robot.mass.sum()):g} kg" in shown
    for name in (*robot.body_names, *robot.all_joint_names):
        assert f">{name}<" in shown
