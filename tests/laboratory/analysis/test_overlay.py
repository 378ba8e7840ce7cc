"""Figures of several flights: every flight is in every panel it belongs to."""

from __future__ import annotations

import numpy as np
import pytest

from space_robot.analysis import excerpt
from space_robot.analysis.figures import errors_and_torques, latency_histogram, pointing
from space_robot.analysis.figures.overlay import words
from space_robot.analysis.plot_series import PlotSeries
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate


@pytest.fixture(scope="module")
def flights() -> dict[str, PlotSeries]:
    found = {}
    for law in ("tde_stc", "ctc", "tde_smc"):
        log = simulate(Flight(resolve(FlightPlan(controller=law, duration=0.3))))
        log.latency_s = None if law == "ctc" else np.linspace(1e-4, 2e-3, log.ticks)
        found[law] = PlotSeries.of(excerpt(log, 0.1, None))
    return found


def test_each_panel_has_a_line_a_flight_over_its_time(flights: dict[str, PlotSeries]) -> None:
    for figure, panels in ((errors_and_torques(flights), 6), (pointing(flights), 4)):
        assert len(figure.axes) == panels
        for axes in figure.axes:
            assert len(axes.get_lines()) == 3
            assert axes.get_xlim() == pytest.approx((0.1, 0.3), abs=0.01)
        names = [text.get_text() for text in figure.legends[0].get_texts()]
        assert names == list(flights)


def test_the_smoothest_line_is_in_front(flights: dict[str, PlotSeries]) -> None:
    axes = errors_and_torques(flights).axes[1]  # base torque
    rough = {
        line.get_color(): np.nansum(np.abs(np.diff(np.asarray(line.get_ydata(), dtype=float))))
        for line in axes.get_lines()
    }
    front = max(axes.get_lines(), key=lambda line: line.get_zorder())
    assert rough[front.get_color()] == min(rough.values())


def test_the_histogram_counts_every_answer(flights: dict[str, PlotSeries]) -> None:
    figure = latency_histogram(flights)
    counts = [patch.get_data().values.sum() for patch in figure.axes[0].patches]  # type: ignore[attr-defined]
    assert counts == [400, 400]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["tde_stc", "tde_smc"]
    assert not latency_histogram({"ctc": flights["ctc"]}).axes
    (axes,) = figure.axes
    for axis in (axes.xaxis, axes.yaxis):
        assert axis.get_major_formatter()(0.1) == "0.1", "not as a power of ten"
    assert axes.xaxis.get_minor_formatter()(0.2) == ""
    edges = axes.patches[0].get_data().edges  # type: ignore[attr-defined]
    known = np.concatenate([flights[law].latency_ms for law in ("tde_stc", "tde_smc")])  # type: ignore[misc]
    assert (edges[0], edges[-1]) == pytest.approx((known.min(), known.max()))
    assert axes.get_ylim()[0] == 0.7


def test_without_a_robot_there_is_no_pointing(flights: dict[str, PlotSeries]) -> None:
    unknown = {name: series._replace(pointing=None) for name, series in flights.items()}
    assert not pointing(unknown).axes


def test_latencies_of_one_length_or_none_are_drawn_too(flights: dict[str, PlotSeries]) -> None:
    for latency in (0.0, 0.5):
        same = flights["tde_stc"]._replace(latency_ms=np.full(30, latency))
        (axes,) = latency_histogram({"same": same}).axes
        assert axes.patches[0].get_data().values.sum() == 30  # type: ignore[attr-defined]


def test_a_logarithmic_panel_shows_all_but_the_few_values_below_its_foot(
    flights: dict[str, PlotSeries],
) -> None:
    axes = errors_and_torques(flights).axes[0]
    assert axes.get_yscale() == "log"
    lowest = [np.percentile(value[value > 0.0], 0.5) for value in _attitude_errors(flights)]
    assert axes.get_ylim()[0] == pytest.approx(0.5 * min(lowest))


def _attitude_errors(flights: dict[str, PlotSeries]) -> list[np.ndarray]:
    return [series.errors["attitude_deg"] for series in flights.values()]


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("joints_1_3", "joints 1-3"),
        ("joints_4", "joints 4"),
        ("attitude", "attitude"),
        ("attitude_deg", "attitude"),
        ("half_cone_arcsec_jitter", "half cone jitter"),
        ("base_torque", "base torque"),
    ],
)
def test_keys_as_words(key: str, text: str) -> None:
    assert words(key) == text
