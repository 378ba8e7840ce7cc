"""Live plots of the last seconds of some curves."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot

from ...analysis.figures.overlay import words
from ...analysis.metrics import error_columns, torque_columns, unit_of
from ..plotted_quantity import AXES

if TYPE_CHECKING:
    from viser import GuiApi

    from .listener import Sample

Array = NDArray[np.float64]

LENGTH_S = 10.0
"""Length of the window in simulated time."""
POINTS = 400
"""Maximum number of points of a curve."""
HEIGHT = 150
"""Height of a plot, px."""


class Curves:
    """Errors and torques over the last seconds, one plot per column of Table V."""

    def __init__(self, gui: GuiApi, robot: Robot, colours: Sequence[str], ink: str) -> None:
        """Add empty plots.

        Args:
            gui: of a server.
            robot: of the flight.
            colours: of the curves.
            ink: colour of axes and text.
        """
        self._rows: deque[tuple[float, Array]] = deque(maxlen=2 * POINTS)
        labels, prismatic = [*AXES, *robot.joint_names], robot.is_prismatic[: robot.n].tolist()
        axes = np.arange(len(labels))
        self._plots = []
        for columns, first in ((error_columns, 0), (torque_columns, len(labels))):
            for name, part in columns(len(labels), True, prismatic).items():
                shown = {labels[axis]: first + axis for axis in axes[part].tolist()}
                self._plots.append(_Plot(gui, name, shown, colours, ink))

    def add(self, sample: Sample) -> None:
        """Add a sample, unless it is too close to the previous one."""
        rows = self._rows
        if rows and sample.time < rows[-1][0] + LENGTH_S / POINTS:
            return
        error = np.zeros_like(sample.torque) if sample.error is None else sample.error
        rows.append((sample.time, np.concatenate([error, sample.torque])))
        while rows[0][0] <= sample.time - LENGTH_S:
            rows.popleft()

    def draw(self) -> None:
        """Update the plots."""
        if len(self._rows) > 1:
            time = np.array([time for time, _ in self._rows])
            values = np.array([row for _, row in self._rows])
            for plot in self._plots:
                plot.draw(time, values)

    def remove(self) -> None:
        """Remove the plots."""
        for plot in self._plots:
            plot.handle.remove()


class _Plot:
    def __init__(
        self, gui: GuiApi, name: str, columns: dict[str, int], colours: Sequence[str], ink: str
    ) -> None:
        self._columns, self._name, self._exponent = list(columns.values()), name, 0
        nothing = np.zeros(2)
        axis: Any = {"stroke": ink, "grid": {"stroke": f"{ink}33"}, "ticks": {"stroke": f"{ink}33"}}
        series: list[Any] = [{"label": "s"}]
        for label, colour in zip(columns, cycle(colours), strict=False):
            series.append({"label": label, "stroke": colour, "width": 1.5})
        self.handle = gui.add_uplot(
            (np.array([0.0, LENGTH_S]), *[nothing] * len(columns)),
            tuple(series),
            title=self._title,
            height=HEIGHT,
            axes=(axis, axis),
            scales={"x": {"time": False}},
            legend={"show": False},
        )

    @property
    def _title(self) -> str:
        unit = unit_of(self._name).strip("-")
        scale = f"1e{self._exponent}" if self._exponent else ""
        return ", ".join(filter(None, (words(self._name), " ".join(filter(None, (scale, unit))))))

    def draw(self, time: Array, values: Array) -> None:
        shown = values[:, self._columns]
        largest = float(np.max(np.abs(shown)))
        # the plot's tick labels have no exponents, so small values are scaled
        exponent = 3 * int(np.floor(np.log10(largest) / 3)) if largest > 0.0 else 0
        if exponent != self._exponent:
            self._exponent = exponent
            self.handle.title = self._title
        scaled = shown / 10.0**exponent
        self.handle.data = (time, *np.ascontiguousarray(scaled.T))
