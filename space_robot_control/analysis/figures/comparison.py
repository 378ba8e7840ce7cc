"""Pictures of several flights together: is a law's command smooth, or does it switch?"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from numpy.typing import NDArray

from ..spectrum import CHATTER_FREQUENCY
from .base_torque import BaseTorque
from .lines import mark_moments, scattered_marks
from .quantity import power_of_ten
from .side_by_side import Stretch, draw_side_by_side, grid_height
from .single_flight import BASE_AXES, JUNCTION_HALF_WIDTH
from .spectrum import power_spectral_density
from .style import (
    LEFT,
    PAGE_WIDTH,
    RIGHT,
    TIME_AXIS,
    Look,
    house_style,
    legend_above,
    legend_height,
    page,
    panel,
)

Array = NDArray[np.float64]

CHATTER_STRETCH = 0.05
"""s of base torque that are shown tick by tick."""

_WIDTH = PAGE_WIDTH - LEFT - RIGHT


@house_style()
def junctions(flights: Mapping[str, BaseTorque]) -> Figure:
    """The base torque x of all laws round the first junction of the mission's segments.

    All panels have one scale. A law that swings much farther than most does not set it: it is cut
    off at the panel's edges, and its heading says how far it goes.

    Args:
        flights: of one mission, by the name of the law.
    """
    moments = [
        flight.start + flight.period * row
        for flight in flights.values()
        for row in flight.junctions[:1]
    ]
    if not moments:
        return page(12.0, "None of these flights passes a junction of two segments.")
    stretch = Stretch(
        "base torque x", slice(0, 1), min(moments), -JUNCTION_HALF_WIDTH, JUNCTION_HALF_WIDTH
    )
    columns, height = min(2, len(flights)), 38.0
    figure = page(1.0 + grid_height(len(flights), columns, height))
    for axes in draw_side_by_side(figure, 1.0, height, columns, flights, stretch):
        mark_moments(axes, np.zeros(1))
    return figure


@house_style()
def chatter(flights: Mapping[str, BaseTorque]) -> Figure:
    """A short stretch of base torque on one scale, and the spectrum of the whole flight.

    The stretch begins at a quarter of the longest flight: when the arm is fastest, if the mission
    has two segments. Scale and headings are those of :func:`junctions`.

    Args:
        flights: of one mission, by the name of the law.
    """
    start = min(flight.start for flight in flights.values())
    moment = start + (max(flight.end for flight in flights.values()) - start) / 4.0
    stretch = Stretch("base torque", slice(0, 3), moment, 0.0, CHATTER_STRETCH)
    columns = math.ceil(len(flights) / math.ceil(len(flights) / 4))
    height, spectrum_height = 32.0, 72.0
    spectra = _spectra(flights)
    top = 1.0 + legend_height(BASE_AXES, _WIDTH)
    spectrum_top = top + grid_height(len(flights), columns, height)
    spectrum_top += 2.0 + legend_height(list(spectra), _WIDTH)
    figure = page(spectrum_top + spectrum_height + TIME_AXIS)
    draw_side_by_side(figure, top, height, columns, flights, stretch, steps=True)
    legend_above(figure, LEFT, top, BASE_AXES, _WIDTH, dashed=False)
    _draw_spectra(panel(figure, LEFT, spectrum_top, _WIDTH, spectrum_height), spectra)
    legend_above(figure, LEFT, spectrum_top, list(spectra), _WIDTH, dashed=True)
    return figure


def _spectra(flights: Mapping[str, BaseTorque]) -> dict[str, tuple[Array, Array]]:
    """Frequency and density of the base torque by the name of the law for the legend."""
    spectra = {}
    for name, flight in flights.items():
        spectrum = power_spectral_density(flight.torque, flight.period)
        spectra[name if len(spectrum[0]) else f"{name}: too short"] = spectrum
    return spectra


def _draw_spectra(axes: Axes, spectra: Mapping[str, tuple[Array, Array]]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for index, (frequency, density) in enumerate(spectra.values()):
        if len(frequency) == 0:
            continue
        look = Look.of(index)
        even = np.geomspace(frequency[0], frequency[-1], 1000)
        marks = np.searchsorted(frequency, even[scattered_marks(len(even), index, len(spectra))])
        axes.plot(
            frequency, density,
            color=look.colour, linestyle=look.dashes, marker=look.marker, markevery=marks.tolist(),
        )  # fmt: skip
    if not axes.get_lines():  # all too short: one mark alone gives no scale
        axes.set_xlim(0.1 * CHATTER_FREQUENCY, 10.0 * CHATTER_FREQUENCY)
    mark_moments(axes, np.array([CHATTER_FREQUENCY]))
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("PSD of base torque, x + y + z ((N m)²/Hz)")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda f, _: f"{f:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda p, _: power_of_ten(round(math.log10(p)))))
    axes.yaxis.set_minor_locator(NullLocator())
