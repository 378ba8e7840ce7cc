"""Figures of the base torque of several flights, to compare the chatter of laws."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import median_low
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..errors import junction_ticks
from ..torques import CHATTER_FREQUENCY
from .single_flight import BASE_AXES, JUNCTION_HALF_WIDTH
from .style import (
    GREY,
    NARROW_PAGE,
    PAGE_WIDTH,
    grid,
    house_style,
    legend_above,
    mark_moments,
    page,
    plain,
    plot_lines,
    plot_spectrum,
)

CHATTER_STRETCH = 0.05
"""Time interval of base torque shown tick by tick, s."""
LOUD = 2.0
"""A flight with more than this multiple of the median range does not affect the scale."""
SEGMENT = 2048
"""Samples of a segment of the spectrum: about 1 Hz of resolution at 2 kHz."""
SHORTEST = 64
"""Minimum number of samples of a spectrum."""


class BaseTorque(NamedTuple):
    """The base's torque over a flight: a fiftieth of its log, to hand from process to process."""

    torque: Array
    """(N, 3) N m, applied in the base frame."""
    period: float
    """s, of a tick."""
    junctions: NDArray[np.intp]
    """Rows at which one motion has ended and another begins."""
    start: float = 0.0
    """s, time of the first row: not 0 in an excerpt of a flight."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Copy it from a whole flight or an excerpt."""
        period = log.timebase.period
        return cls(
            log.applied_torque[:, :3].copy(), period, junction_ticks(log), log.first_tick * period
        )

    @property
    def time(self) -> Array:
        """Times of the rows, (N,) s."""
        return self.start + np.arange(len(self.torque), dtype=np.float64) * self.period

    @property
    def end(self) -> float:
        """End of the flight, s."""
        return self.start + len(self.torque) * self.period


@house_style()
def junctions(flights: Mapping[str, BaseTorque], width: float = PAGE_WIDTH) -> Figure:
    """Draw the base torque x of all laws at the first junction of the mission's segments.

    All panels have the same scale. A law with a much larger range than most does not affect it: its
    curve is cut off at the edges, and its heading has the range. The flights are of one mission.
    """
    moments = [
        flight.start + flight.period * row
        for flight in flights.values()
        for row in flight.junctions[:1]
    ]
    if not moments:
        return page(12.0, "None of these flights passes a junction of two segments.")
    columns = 1 if width < NARROW_PAGE else min(2, len(flights))
    figure = page(12.0 + 45.0 * math.ceil(len(flights) / columns), width=width)
    interval = -JUNCTION_HALF_WIDTH, JUNCTION_HALF_WIDTH
    panels = _draw_side_by_side(figure, columns, flights, min(moments), interval, 1)
    for axes in panels:
        mark_moments(axes, np.zeros(1))
    for axes in panels[::columns]:
        axes.set_ylabel("base torque x (N m)")
    return figure


@house_style()
def chatter(flights: Mapping[str, BaseTorque], width: float = PAGE_WIDTH) -> Figure:
    """Draw a short interval of base torque on one scale, and the spectrum of the whole flight.

    The interval begins at a quarter of the longest flight: when the arm is fastest, if the mission
    has two segments. Scale and headings are those of `junctions`.
    """
    start = min(flight.start for flight in flights.values())
    moment = start + (max(flight.end for flight in flights.values()) - start) / 4.0
    rows = math.ceil(len(flights) / (2 if width < NARROW_PAGE else 4))
    columns = math.ceil(len(flights) / rows)
    height, spectrum_height = 20.0 + 38.0 * math.ceil(len(flights) / columns), 90.0
    figure = page(height + spectrum_height, width=width)
    parts = figure.add_gridspec(2, 1, height_ratios=(height, spectrum_height))
    above, below = figure.add_subfigure(parts[0]), figure.add_subfigure(parts[1])
    interval = 0.0, CHATTER_STRETCH
    panels = _draw_side_by_side(above, columns, flights, moment, interval, 3, steps=True)
    for axes in panels[::columns]:
        axes.set_ylabel("base torque (N m)")
    legend_above(above, BASE_AXES, dashed=False)
    spectra = {
        name: power_spectral_density(flight.torque, flight.period)
        for name, flight in flights.items()
    }
    _draw_spectra(below.add_subplot(), spectra)
    names = [n if len(f) else f"{n}: too short" for n, (f, _) in spectra.items()]
    if len(names) > 1:
        legend_above(below, names, dashed=True)
    return figure


def power_spectral_density(values: Array, period: float) -> tuple[Array, Array]:
    """Estimate the power spectral density of all columns together by Welch's method.

    The trend of each segment is removed, or slow motion would leak into the high frequencies. Rows
    of values (N, axes) from the first that is not finite are ignored; ``period`` is in s.

    Returns:
        Frequencies above 0, Hz, and the density in the square of the values' unit per Hz, NaN for
        zero power; both empty if there are too few samples.
    """
    from scipy import signal  # slow to import

    known = np.all(np.isfinite(values), axis=1)
    samples = values[: len(values) if known.all() else int(np.argmin(known))]
    if len(samples) < SHORTEST:
        return np.empty(0), np.empty(0)
    detrend: Any = signal.detrend  # its overloads do not match welch's types in SciPy 1.15
    frequency, density = signal.welch(
        samples.T, 1.0 / period, nperseg=min(SEGMENT, len(samples)), detrend=detrend
    )
    total = np.sum(density[:, 1:], axis=0)
    return frequency[1:], np.where(total > 0.0, total, np.nan)


def _draw_spectra(axes: Axes, spectra: Mapping[str, tuple[Array, Array]]) -> None:
    for index, (frequency, density) in enumerate(spectra.values()):
        if not np.isfinite(density).any():  # too short, or zero torque
            continue
        plot_spectrum(axes, frequency, density, index, len(spectra))
    axes.set(xscale="log", yscale="log")
    if not axes.get_lines():  # a single marker defines no scale
        axes.set_xlim(0.1 * CHATTER_FREQUENCY, 10.0 * CHATTER_FREQUENCY)
    mark_moments(axes, np.array([CHATTER_FREQUENCY]))
    axes.set(xlabel="frequency (Hz)", ylabel="PSD of base torque, x + y + z ((N m)²/Hz)")
    axes.xaxis.set_major_formatter("{x:g}")


def _draw_side_by_side(
    figure: FigureBase,
    columns: int,
    flights: Mapping[str, BaseTorque],
    moment: float,
    interval: tuple[float, float],
    axis_count: int,
    steps: bool = False,
) -> list[Axes]:
    """Plot an interval from ``moment``, s, of each flight in a panel, all on one scale."""
    curves = {}
    for name, flight in flights.items():
        time = flight.time - moment
        shown = (time > interval[0] - 1e-9) & (time < interval[1] + 1e-9)
        curves[name] = time[shown], flight.torque[shown, :axis_count]
    low, high = common_limits([torque for _, torque in curves.values()])
    panels = grid(figure, len(flights), columns)
    for number, (axes, (name, (time, torque))) in enumerate(
        zip(panels, curves.items(), strict=True)
    ):
        if np.isfinite(torque).any():
            marks = None if torque.shape[1] > 1 else np.empty(0, np.intp)
            plot_lines(axes, 1e3 * time, torque, marks=marks, steps=steps)
        else:
            axes.text(
                0.03, 0.5, f"ended at {flights[name].end:g} s", color=GREY, transform=axes.transAxes
            )
        axes.set_title(plain(name + _cut(torque, low, high)))
        if number + columns >= len(panels):
            axes.set_xlabel(f"time from {moment:g} s (ms)")
    panels[0].set(xlim=[1e3 * time for time in interval], ylim=(low, high))
    return panels


def common_limits(torques: Sequence[Array]) -> tuple[float, float]:
    """Return limits, N m, of all ``torques`` except those above `LOUD`, with a margin."""
    known = [torque[np.isfinite(torque)] for torque in torques]
    known = [torque for torque in known if len(torque)]
    if not known:
        return -1.0, 1.0
    ranges = [float(np.ptp(torque)) for torque in known]
    usual = median_low(ranges)
    quiet = [t for t, range_ in zip(known, ranges, strict=True) if range_ <= LOUD * usual]
    low, high = min(float(t.min()) for t in quiet), max(float(t.max()) for t in quiet)
    margin = 0.05 * (high - low) or max(0.05 * abs(high), 0.01)
    return low - margin, high + margin


def _cut(torque: Array, low: float, high: float) -> str:
    """Return the range of a torque beyond the limits, for the heading; else empty."""
    known = torque[np.isfinite(torque)]
    if not len(known) or (known.min() >= low and known.max() <= high):
        return ""
    return f", cut: {known.min():.2g} … {known.max():.2g}"
