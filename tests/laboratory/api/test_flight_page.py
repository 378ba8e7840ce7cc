"""`FlownFlight.view` without a notebook: a file that is written, opened and named."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest
from scene_pages import Scene, plot_data

from space_robot import FlownFlight, Scenario
from space_robot.api.flight_page import unique_names
from space_robot_msgs_py.errors import InputError

pytest.importorskip("viser")


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
    labels = {
        series["label"] for plot in plot_data(page.html)["plots"] for series in plot["series"]
    }
    assert any("ctc" in label for label in labels)


def test_plots_are_chosen_by_their_names(flight: FlownFlight, opened: list[str]) -> None:
    page = flight.view(plots=["momentum"], opens=False)
    assert page.html != flight.view(opens=False).html
    with pytest.raises(InputError, match="unknown plot 'moment'"):
        flight.view(plots=["moment"])


def test_a_file_that_cannot_be_written_is_told(flight: FlownFlight, opened: list[str]) -> None:
    Path("file").touch()
    with pytest.raises(InputError, match="file"):
        flight.view(path="file/page.html")


def test_names_are_unique() -> None:
    assert unique_names(["ctc", "pd", "ctc", "ctc"]) == ["ctc", "pd", "ctc 2", "ctc 3"]
