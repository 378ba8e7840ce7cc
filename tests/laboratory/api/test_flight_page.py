"""`FlownFlight.view` writes and opens a page; in a notebook flights and others show themselves."""

from __future__ import annotations

import html
import re
import webbrowser
from pathlib import Path
from types import SimpleNamespace

import pytest
from scene_pages import Scene, plot_data

from space_robot import Campaign, FlownFlight, Scenario
from space_robot.api.flight_page import unique_names
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

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
    chosen = flight.view(plots=["momentum"], opens=False)
    assert chosen.html != flight.view(opens=False).html
    with pytest.raises(InputError, match="unknown plot 'moment'"):
        flight.view(plots=["moment"])
    with pytest.raises(InputError, match="tde_stc_view"):
        flight.view(path="tde_stc_view.html/page.html")
    assert unique_names(["ctc", "pd", "ctc", "ctc"]) == ["ctc", "pd", "ctc 2", "ctc 3"]


class Output:
    """Of a cell: what it shows in the end."""

    def __init__(self, bundle: dict[str, str]) -> None:
        self.update(bundle)

    def update(self, bundle: dict[str, str], **_: object) -> None:
        self.bundle = bundle


@pytest.fixture
def outputs(monkeypatch: pytest.MonkeyPatch, opened: list[str]) -> list[Output]:
    """Those of a cell of a notebook, in which nothing is opened."""
    ipython = pytest.importorskip("IPython")
    shown: list[Output] = []
    monkeypatch.setattr(ipython, "get_ipython", lambda: SimpleNamespace(kernel=object()))

    def display(bundle: dict[str, str], **_: object) -> Output:
        shown.append(Output(bundle))
        return shown[-1]

    monkeypatch.setattr(ipython.display, "display", display)
    return shown


def test_a_page_in_a_cell_is_small_and_needs_no_network(
    flight: FlownFlight, outputs: list[Output], opened: list[str], tmp_path: Path
) -> None:
    shown = flight.view(rate=2.0)._repr_html_()
    assert (opened, [*tmp_path.iterdir()]) == ([], [])
    assert len(shown.encode()) < LARGEST
    frame = re.fullmatch(r'<iframe srcdoc="([^"]*)" [^<>]*></iframe>', shown)
    assert frame
    document = html.unescape(frame[1])
    assert "<title>tde_stc</title>" in document
    assert not re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', document)
    assert Scene(document).duration > 0.0
    assert [output.bundle["text/html"] for output in outputs] == [""]  # its progress is over


def test_scenario_flight_campaign_and_robot_show_themselves_in_a_cell(
    outputs: list[Output],
) -> None:
    scenario = Scenario(case="3", duration=0.5, seed=7)
    rows = [
        re.findall(r"<td[^>]*>(.*?)</td>", row) for row in scenario._repr_html_().split("<tr>")[2:]
    ]
    assert rows == [
        ["case", "3", "1"],
        ["duration", "0.5", "the mission&#x27;s"],
        ["seed", "7", "0"],
    ]
    assert "complete" in scenario.fly(progress=True)._repr_html_()
    assert '<progress value="0.5" max="0.5">' in outputs[-1].bundle["text/html"]
    campaign = Campaign.load("first")._repr_html_()
    assert "tde_stc, ctc, 20 runs, 40 flights" in campaign
    assert "{normal: 1.0, relative: true, sigma: 0.05}" in campaign
    assert "attitude_max below 0.001 in 90 % of the cases, with 90 % confidence" in campaign
    dual_arm = find_robot("dual_arm")
    robot = dual_arm._repr_html_()
    assert f"{float(dual_arm.mass.sum()):g} kg" in robot
    assert all(f">{n}<" in robot for n in (*dual_arm.body_names, *dual_arm.all_joint_names))
