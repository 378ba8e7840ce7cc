"""`FlownFlight.view` writes and opens a page; in a notebook flights and others show themselves."""

from __future__ import annotations

import html
import re
import sys
import webbrowser
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from paths import DOCS
from scene_pages import Scene, plot_data

from space_robot import FlownFlight, Scenario
from space_robot.api.flight_page import unique_names
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

CELLS = (
    "import space_robot as sr\nscenario = sr.Scenario(case='3', duration=0.5, seed=7)\nscenario",
    "flight = scenario.fly()\nflight",
    "flight.view(rate=2.0)",
    "sr.Campaign.load('first')",
    "from space_robot_model.robot.find import find_robot\nfind_robot('dual_arm')",
)
LARGEST = 2.5e6
"""Bytes of an output: Jupyter's server passes on 1e6 a second, measured over 3 s."""


@pytest.fixture(scope="module")
def flight() -> FlownFlight:
    return Scenario(duration=0.1).fly()


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Addresses that a browser was asked to open."""
    addresses: list[str] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda url: addresses.append(url) or True)
    return addresses


def test_the_page_is_written_and_opened(
    flight: FlownFlight, opened: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = flight.view()
    assert (tmp_path / "tde_stc_view.html").read_text("utf-8") == page.html
    assert opened == [(tmp_path / "tde_stc_view.html").as_uri()]
    assert "wrote tde_stc_view.html (" in capsys.readouterr().err
    assert "MB" in repr(page)


def test_others_are_drawn_over_it(flight: FlownFlight, opened: list[str], tmp_path: Path) -> None:
    others = [Scenario(controller="ctc", duration=0.1).fly(), flight]
    page = flight.view(*others, path="pages/laws.html", opens=False, rate=10.0, title="Laws")
    assert (tmp_path / "pages/laws.html").read_text("utf-8") == page.html
    assert not opened
    assert "<title>Laws</title>" in page.html
    roots = {name.split("/")[1] for name in Scene(page.html).names() if "base_link" in name}
    assert len(roots) == 3
    plots = plot_data(page.html)["plots"]
    assert any("ctc" in series["label"] for plot in plots for series in plot["series"])
    assert unique_names(["ctc", "pd", "ctc", "ctc"]) == ["ctc", "pd", "ctc 2", "ctc 3"]


def test_plots_are_chosen_and_what_cannot_be_is_told(
    flight: FlownFlight, opened: list[str]
) -> None:
    page = flight.view(plots=["momentum"], opens=False)
    assert page.html != flight.view(opens=False).html
    with pytest.raises(InputError, match="unknown plot 'moment'"):
        flight.view(plots=["moment"])
    Path("file").touch()
    with pytest.raises(InputError, match="file"):
        flight.view(path="file/page.html")


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
def outputs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The HTML of each cell's last output."""
    pytest.importorskip("ipykernel")
    nbformat = pytest.importorskip("nbformat")
    sys.path.insert(0, str(DOCS / "notebooks"))
    from execute import executed

    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS],
        metadata={"language_info": {"name": "python", "version": ""}},
    )
    file: Path = tmp_path_factory.mktemp("notebook") / "own.ipynb"
    nbformat.write(notebook, file)
    cells: Any = executed(file).cells
    return [str(cell.outputs[-1].data["text/html"]) for cell in cells]


def test_scenario_flight_campaign_and_robot_show_themselves_in_a_cell(outputs: list[str]) -> None:
    scenario, flight, _, campaign, robot = outputs
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in scenario.split("<tr>")[2:]]
    assert rows == [
        ["case", "3", "1"],
        ["duration", "0.5", "the mission&#x27;s"],
        ["seed", "7", "0"],
    ]
    assert "complete" in flight
    assert "tde_stc, ctc, 20 runs, 40 flights" in campaign
    assert "{normal: 1.0, relative: true, sigma: 0.05}" in campaign
    assert "attitude_max below 0.001 in 90 % of the cases, with 90 % confidence" in campaign
    dual_arm = find_robot("dual_arm")
    assert f"{float(dual_arm.mass.sum()):g} kg" in robot
    assert all(f">{n}<" in robot for n in (*dual_arm.body_names, *dual_arm.all_joint_names))


def test_a_page_in_a_cell_is_small_and_needs_no_network(outputs: list[str]) -> None:
    assert len(outputs[2].encode()) < LARGEST
    document = Frame(outputs[2]).document
    assert "<title>tde_stc</title>" in document
    assert not re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', document)
    scene = re.search(r'srcdoc="([^"]*)"', document)
    assert scene
    assert "__VISER_EMBED_DATA__" in html.unescape(scene[1])
