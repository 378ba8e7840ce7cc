"""The lines of the proofs' figures are the numbers they stand for."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from space_robot.paper.stability import figures
from space_robot.paper.stability.circle_criterion import transfer_function
from space_robot.paper.stability.lyapunov import certify

GAINS = (1.5, 3.0)


@pytest.mark.parametrize("measured", [0.0, 0.4])
def test_a_panel_of_nyquist_has_the_curve_and_the_circles_of_both_betas(measured: float) -> None:
    panel = Figure().add_subplot()
    figures._nyquist_panel(panel, GAINS, 0.8, measured)
    lines = {str(line.get_label()): line.get_xydata() for line in panel.lines}
    for beta, word in ((0.8, "tolerated"), (measured, "measured")):
        circles = [xy for label, xy in lines.items() if label.endswith(word)]
        assert len(circles) == (beta > 0.0)
        for circle in circles:
            np.testing.assert_allclose(np.linalg.norm(circle, axis=1), 1.0 / beta, rtol=1e-12)
            np.testing.assert_allclose(circle[0], circle[-1], atol=1e-12)
            np.testing.assert_allclose(circle[90], (0.0, 1.0 / beta), atol=1e-12)
    (curve,) = (xy for label, xy in lines.items() if label.startswith("$G"))
    half = np.geomspace(1e-3, 1e3, len(curve) // 2) * np.sqrt(GAINS[1] / 2.0)
    expected = transfer_function(*GAINS, np.concatenate([-half[::-1], half]))
    np.testing.assert_allclose(curve[:, 0] + 1j * curve[:, 1], expected, rtol=1e-12)
    reach = 1.1 / 0.8
    assert panel.get_xlim() == panel.get_ylim() == pytest.approx((-reach, reach))


def test_v_is_drawn_with_its_peaks_against_v_at_the_start_and_the_bound_of_55() -> None:
    """Of the last two axes there is nothing to draw: no solution of (51), or no error to begin."""
    random = np.random.default_rng(3)
    time = np.arange(0.0, 5.0, 5e-4)
    eta = np.exp(-time)[:, np.newaxis, np.newaxis] * random.normal(1.0, 0.2, (len(time), 4, 2))
    eta[:, 3] = 0.0
    certificate = certify(2.0, 1.0, 0.1)
    assert certificate is not None
    limits = [4.0, 6.0, 4.0, 4.0]
    measured: Any = SimpleNamespace(
        reaching=SimpleNamespace(time=time, eta=eta),
        certificates=[certificate, certificate, None, certificate],
        measured_certificates=[certificate, None, None, certificate],
        reaching_time=[
            SimpleNamespace(limit=limit, value=value)
            for limit, value in zip(limits, [1.5, math.inf, 1.0, 1.0], strict=True)
        ],
    )
    figure = figures.lyapunov(measured, ("base x", "joint1", "joint2", "joint3"))
    panels = figure.axes
    assert [panel.get_title(loc="left") for panel in panels] == [
        "base x",
        "joint1",
        "joint2",
        "joint3",
    ]
    said = [[text.get_text() for text in panel.texts] for panel in panels]
    assert said == [[], [], ["no solution of (51)"], ["V(0) = 0"]]
    assert not panels[2].lines
    assert not panels[3].lines
    for axis, (panel, word) in enumerate(zip(panels[:2], ("measured", "assumed"), strict=True)):
        own = np.einsum("ti,ij,tj->t", eta[:, axis], certificate.m, eta[:, axis])
        curve, bound = panel.lines[0].get_xydata(), panel.lines[1].get_xydata()
        ticks = np.round(curve[:, 0] / 5e-4).astype(int)
        assert ticks[0] == 1
        assert ticks[-1] == len(time) - 1
        for (_, value), tick, after in zip(curve, ticks, [*ticks[1:], len(time)], strict=True):
            assert value == pytest.approx(own[tick:after].max() / own[0])
        start = math.sqrt(own[0])
        expected = (start - 0.5 * certificate.decay * bound[:, 0]).clip(0.0) ** 2 / own[0]
        np.testing.assert_allclose(bound[:, 1], expected, rtol=1e-9)
        assert bound[0, 0] == pytest.approx(5e-4)
        assert bound[-1, 0] == pytest.approx(0.999 * limits[axis])
        assert panel.lines[1].get_label() == rf"bound (55) for the {word} $\beta$"
        assert panel.get_xlim()[0] == pytest.approx(5e-4)
    assert [list(line.get_xdata()) for line in panels[0].lines[2:]] == [[1.5, 1.5]]
    assert len(panels[1].lines) == 2, "|s| was not reached"
    assert figure.legends


def test_axes_of_the_same_gains_share_a_panel_of_nyquist() -> None:
    twisting: Any = SimpleNamespace(
        gains=((2.0, 1.0), (0.0, 0.0), (3.0, 1.0), (2.0, 1.0)),
        tolerated_beta=np.array([0.5, 0.0, 0.25, 0.5]),
        beta=np.array([0.2, 9.0, 0.1, 0.125]),
    )
    figure = figures.nyquist(twisting, ("base x", "base y", "joint1", "joint2"))
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles == [
        "base x, joint2\n" r"$\beta$ tolerated 0.5, measured 0.125 or more",
        "joint1\n" r"$\beta$ tolerated 0.25, measured 0.1 or more",
    ]
    for panel, beta in zip(figure.axes, (0.5, 0.25), strict=True):
        assert panel.get_xlim()[1] == pytest.approx(1.1 / beta)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(labels) == len(set(labels)) == 3
