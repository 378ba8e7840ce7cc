"""Animated picture of a flight: the scene, rendered by a browser, with a few curves."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.plot_series import tick_times
from .browser import FRAME_TIMEOUT_S, headless_browser
from .film import FilmedFlight, add_flights
from .local_server import local_server
from .plots import Plot
from .stage import Rendering

if TYPE_CHECKING:
    from PIL.Image import Image

Array = NDArray[np.float64]

FORMATS = (".webp", ".gif", ".png")
"""File formats; PNG is APNG."""
SIZE = (760, 500)
"""Width and height, px."""
RATE_HZ = 12.5
LENGTH_S = 10.0
"""Duration of the animation, independent of the flight's."""
ASIDE = 0.17
"""Shift of the robot to the left, relative to the picture's width: curves are on the right."""
PICTURE = Rendering(shadows=False, labels=False, far=1000.0)
"""viser renders pictures up to that distance, and draws labels in them too large."""
INK, FAINT = "#c9d1d9", "#57606a"
TOP, BOTTOM = (13, 17, 23), (27, 35, 48)
"""Colours of the background."""


def animate(
    flight: FilmedFlight,
    plots: Sequence[Plot],
    caption: str,
    advance: Callable[[int], Callable[[], None]],
) -> list[Image]:
    """Render the frames of a flight.

    Args:
        flight: to be shown.
        plots: curves drawn beside the robot.
        caption: one line.
        advance: called with the number of frames, then after each frame.

    Raises:
        InputError: there is no browser, or the flight has no state.
        FlightError: the browser did not start.
    """
    from PIL import Image

    width, height = SIZE
    start, *_, end = tick_times(flight.log)
    times = np.linspace(start, end, round(LENGTH_S * RATE_HZ))
    ground = Image.fromarray(_gradient(width, height))
    overlay = _Overlay(plots, times, caption)
    drawn = []
    with local_server() as server:
        moves = add_flights(server, [flight], times, False, True, PICTURE)
        camera = server.initial_camera
        up = np.array([0.0, 0.0, 1.0]) if camera.up is None else camera.up
        pose = _camera(camera.position, camera.look_at, up)
        fov = float(camera.fov)
        with headless_browser(server) as client:

            def draw(k: int) -> NDArray[np.uint8]:
                with server.atomic():
                    for move in moves:
                        move(k)
                return client.get_render(
                    height,
                    width,
                    wxyz=pose[0],
                    position=pose[1],
                    fov=fov,
                    transport_format="png",
                    timeout=FRAME_TIMEOUT_S,
                )

            done = advance(len(times))
            draw(0)  # the first picture may be incomplete
            for k in range(len(times)):
                frame = ground.copy()
                for layer in (draw(k), overlay.draw(k)):
                    frame.alpha_composite(Image.fromarray(layer))
                drawn.append(frame.convert("RGB"))
                done()
    return drawn


def encoded(frames: Sequence[Image], file: Path) -> bytes:
    """Return an endless animation in the format of the file's suffix, one of `FORMATS`."""
    first, *others = frames
    options: Any = {".webp": {"quality": 72, "method": 6}, ".gif": {"optimize": True}, ".png": {}}
    written = io.BytesIO()
    first.save(
        written,
        file.suffix[1:],
        save_all=True,
        append_images=others,
        duration=round(1000 / RATE_HZ),
        loop=0,
        **options[file.suffix],
    )
    return written.getvalue()


def _camera(position: Array, look_at: Array, up: Array) -> tuple[Array, Array]:
    """Return attitude ``[w, x, y, z]`` and position of a camera with the robot on the left."""
    from scipy.spatial.transform import Rotation

    back = position - look_at
    forward = -back / np.linalg.norm(back)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    aside = ASIDE * np.linalg.norm(back) * right
    x, y, z, w = Rotation.from_matrix(
        np.column_stack([right, np.cross(forward, right), forward])
    ).as_quat()
    return np.array([w, x, y, z]), look_at + back + aside


def _gradient(width: int, height: int) -> NDArray[np.uint8]:
    rows = np.linspace(TOP, BOTTOM, height)[:, np.newaxis]
    ground = np.full((height, width, 4), 255, np.uint8)
    ground[..., :3] = np.broadcast_to(rows, (height, width, 3)).round()
    return ground


class _Overlay:
    """Caption, time and curves, up to each frame's time."""

    def __init__(self, plots: Sequence[Plot], times: Array, caption: str) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, facecolor="none")
        self._canvas: Any = FigureCanvasAgg(figure)
        self._times, self._lines = times, []
        figure.text(0.025, 0.93, caption, color=INK, size=11, weight="bold")
        self._clock = figure.text(0.025, 0.045, "", color=INK, size=11, family="monospace")
        share = 0.86 / len(plots)
        for index, plot in enumerate(plots):
            axes = figure.add_axes((0.69, 0.95 - share * (index + 1) + 0.05, 0.29, share - 0.10))
            self._decorate(axes, plot)
            place, stem = 1.0, plot.series[0].label.rstrip("0123456789")  # of joint1, joint2
            for series in reversed(plot.series):
                (line,) = axes.plot([], [], color=series.colour, linewidth=1.2)
                self._lines.append((line, plot.time, series.values))
                label = series.label.removeprefix(stem) or series.label
                axes.text(
                    place,
                    1.03,
                    label,
                    color=series.colour,
                    size=9,
                    ha="right",
                    transform=axes.transAxes,
                )
                place -= 0.03 + 0.03 * len(label)
        axes.set_xlabel("s", color=FAINT, size=8, labelpad=1)

    def _decorate(self, axes: object, plot: Plot) -> None:
        from matplotlib.axes import Axes

        assert isinstance(axes, Axes)
        values = np.array([series.values for series in plot.series])
        low, high = np.nanmin(values), np.nanmax(values)
        axes.set(xlim=(self._times[0], self._times[-1]), facecolor="none")
        axes.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))
        unit = f", {plot.unit}" if plot.unit else ""
        axes.set_title(f"{plot.title}{unit}", color=INK, size=9, loc="left", pad=3)
        axes.tick_params(colors=FAINT, labelsize=7, length=2)
        axes.yaxis.get_offset_text().set(color=FAINT, size=7)
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(FAINT)

    def draw(self, k: int) -> NDArray[np.uint8]:
        """Return the picture (height, width, 4) at the k-th time."""
        now = self._times[k]
        for line, seconds, values in self._lines:
            flown = seconds <= now
            line.set_data(seconds[flown], values[flown])
        self._clock.set_text(f"t = {now:4.1f} s")
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())
