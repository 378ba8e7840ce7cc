"""The lines of the proofs' figures are the numbers they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from space_robot.paper.stability import figures
from space_robot.paper.stability.circle_criterion import transfer_function

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
