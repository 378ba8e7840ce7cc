"""Live plots of the last seconds of some curves."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot

from ...analysis.errors import angles_of, axis_groups, error_columns, torque_columns
from ...analysis.measure import column_label, column_unit
from ..plotted_quantity import AXES

if TYPE_CHECKING:
    from viser import GuiApi, GuiCheckboxHandle, GuiEvent

    from .listener import Sample

Array = NDArray[np.float64]

LENGTH_S = 10.0
"""Length of the window in simulated time."""
POINTS = 400
"""Maximum number of points of a curve."""
HEIGHT = 150
"""Height of a plot, px."""


class Curves:
    """Errors, torques and wheel speeds over the last seconds, which can be chosen."""

    def __init__(
        self,
        gui: GuiApi,
        robot: Robot,
        wheels: int,
        colours: Sequence[str],
        ink: str,
        kinds: Sequence[str],
    ) -> None:
        """Add empty plots.

        Args:
            gui: of a server.
            robot: of the flight.
            wheels: number of its wheels.
            colours: of the curves.
            ink: colour of axes and text.
            kinds: of the plots that are shown first, see `PLOT_KINDS`; empty: all but the wheels'.
        """
        self._rows: deque[tuple[float, Array]] = deque(maxlen=2 * POINTS)
        labels, prismatic = [*AXES, *robot.joint_names], robot.is_prismatic[: robot.n].tolist()
        axes = np.arange(len(labels))
        curves: list[tuple[str, str, str, dict[str, int]]] = []
        for columns, first in ((error_columns, 0), (torque_columns, len(labels))):
            for name, part in columns(axis_groups(robot.n, True, prismatic)).items():
                kind = "torques" if first else "attitude" if name == "attitude" else "joints"
                shown = {labels[axis]: first + axis for axis in axes[part].tolist()}
                unit = "deg" if kind == "attitude" else column_unit(name)
                curves.append((kind, column_label(name), unit, shown))
        if wheels:
            shown = {f"wheel_{k + 1}": 2 * len(labels) + k for k in range(wheels)}
            curves.append(("wheels", "wheel speed", "rad/s", shown))
        self._folder = gui.add_folder("Plots", expand_by_default=False)
        self._plots = []
        for kind, title, unit, shown in curves:
            is_shown = kind in kinds if kinds else kind != "wheels"
            with self._folder:
                box = gui.add_checkbox(title, is_shown)
            plot = _Plot(gui, title, unit, shown, colours, ink)
            plot.handle.visible = is_shown
            box.on_update(plot.follow)
            self._plots.append(plot)

    def add(self, sample: Sample) -> None:
        """Add a sample, unless it is too close to the previous one."""
        rows = self._rows
        if rows and sample.time < rows[-1][0] + LENGTH_S / POINTS:
            return
        error = np.zeros_like(sample.torque) if sample.error is None else sample.error.copy()
        error[:3] = angles_of(error[np.newaxis, :3])[0]
        rows.append((sample.time, np.concatenate([error, sample.torque, sample.wheels[0]])))
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
        self._folder.remove()
        for plot in self._plots:
            plot.handle.remove()


class _Plot:
    def __init__(
        self,
        gui: GuiApi,
        name: str,
        unit: str,
        columns: dict[str, int],
        colours: Sequence[str],
        ink: str,
    ) -> None:
        self._columns, self._name, self._unit = list(columns.values()), name, unit
        self._exponent = 0
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
        scale = f"1e{self._exponent}" if self._exponent else ""
        return ", ".join(filter(None, (self._name, " ".join(filter(None, (scale, self._unit))))))

    def follow(self, event: GuiEvent[GuiCheckboxHandle]) -> None:
        """Show the plot if its checkbox is checked."""
        self.handle.visible = event.target.value

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
