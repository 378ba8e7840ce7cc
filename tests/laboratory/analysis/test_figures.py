"""The figures: what they draw is what was flown, readable, and the same bytes every time."""

from __future__ import annotations

import math
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox
from PIL import Image
from random_robots import random_robot
from scipy import signal

from space_robot.analysis import excerpt, tracking_error
from space_robot.analysis.figures import (
    chatter,
    control_results,
    desired_joints,
    junctions,
    save_figure,
)
from space_robot.analysis.figures.base_torque import common_limits, power_spectral_density
from space_robot.analysis.figures.style import LineStyle, house_style, thinned
from space_robot.analysis.metrics import attitude_angles
from space_robot.analysis.plot_series import BaseTorque
from space_robot.analysis.waypoints import junction_ticks, waypoint_ticks
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
PAPER_TIMES = (0.0, 15.0, 30.0)


def flown(
    n: int = 6,
    times: tuple[float, ...] = PAPER_TIMES,
    duration: float | None = None,
    ripple: float = 0.0,
    error: float = 1e-8,
    names: tuple[str, ...] | None = None,
) -> FlightLog:
    """A log with a real mission, errors of a size, and torques with noise of the size ripple."""
    random = np.random.default_rng(7)
    angles = random.uniform(-90.0, 90.0, (len(times), n))
    settings = MissionSettings(waypoint_times=list(times), waypoints_deg=angles.ravel().tolist())
    ticks = round((times[-1] if duration is None else duration) / PERIOD)
    chunk = Mission(random_robot(np.random.default_rng(n), n), settings, PERIOD).chunk(0, ticks)
    joints = names or tuple(f"joint{i + 1}" for i in range(n))
    log = FlightLog.allocate(ticks, joints, Timebase(500_000))
    log.reference_joints[:], log.reference_base[:] = chunk.joints, chunk.base
    phase = np.arange(ticks)[:, np.newaxis] * PERIOD + np.arange(n + 3)
    wave = np.sin(phase)
    log.joint_positions[:] = log.reference_joints[:, 0] - error * wave[:, 3:]
    log.quaternion[:] = 1.0
    log.quaternion[:, 1:] = -error * wave[:, :3]
    log.applied_torque[:] = np.cos(phase) + ripple * random.uniform(-1.0, 1.0, wave.shape)
    return log


def base_torques(logs: Mapping[str, FlightLog]) -> dict[str, BaseTorque]:
    return {name: BaseTorque.of(log) for name, log in logs.items()}


def curves(axes: Axes) -> list[Line2D]:
    """The lines of data, without the dotted upright ones."""
    return [line for line in axes.get_lines() if line.get_linestyle() != ":"]


def by_look(axes: Axes, index: int) -> Line2D:
    look = LineStyle.of(index)
    found = [x for x in curves(axes) if (x.get_color(), x.get_marker()) == look[:2]]
    assert len(found) == 1
    return found[0]


def legend_names(figure: Figure) -> list[list[str]]:
    return [[text.get_text() for text in legend.get_texts()] for legend in legends(figure)]


def legends(figure: Figure) -> list[Legend]:
    """Of the figure, its parts and its panels."""
    found = [*figure.legends, *(x for part in figure.subfigs for x in part.legends)]
    return found + [x for axes in figure.axes if (x := axes.get_legend()) is not None]


class TestThinning:
    @given(
        arrays(np.float64, st.integers(1, 700), elements=st.floats(-1e9, 1e9) | st.just(math.nan)),
        st.integers(1, 60),
    )
    def test_keeps_ends_and_the_extremes_of_every_column(
        self, signal: np.ndarray, columns: int
    ) -> None:
        kept = thinned(signal, columns)
        assert (kept[0], kept[-1]) == (0, len(signal) - 1)
        assert np.all(np.diff(kept) > 0)
        if len(signal) <= 2 * columns:
            assert len(kept) == len(signal)
            return
        assert len(kept) <= 2 * columns + 2
        length = math.ceil(len(signal) / columns)
        for start in range(0, len(signal), length):
            stretch = signal[start : start + length]
            drawn = signal[kept[(kept >= start) & (kept < start + length)]]
            if not np.isnan(stretch).all():
                assert np.nanmin(drawn) == np.nanmin(stretch)
                assert np.nanmax(drawn) == np.nanmax(stretch)

    def test_one_tick_of_60000_stays(self) -> None:
        signal = np.zeros(60000)
        signal[31234] = 1.0
        assert 31234 in thinned(signal)


class TestWaypoints:
    def test_of_the_papers_mission(self) -> None:
        log = flown()
        assert waypoint_ticks(log).tolist() == [0, 30000, 59999]
        assert junction_ticks(log).tolist() == [30000]

    @pytest.mark.parametrize(
        ("times", "duration", "expected"),
        [
            ((0.0, 2.0), 3.0, [0, 4000, 5999]),  # held after the last one
            ((0.0, 1.00025, 3.0), None, [0, 2001, 5999]),  # between two ticks
            ((0.0, 2.0, 4.0), 1.0, [0]),  # cut short
            ((0.0, 2.0, 4.0), 0.0055, [0]),
            ((0.0,), 1.0, [0]),  # nothing moves
        ],
    )
    def test_of_others(
        self, times: tuple[float, ...], duration: float | None, expected: list[int]
    ) -> None:
        ticks = waypoint_ticks(flown(times=times, duration=duration))
        assert len(ticks) == len(expected)
        assert np.all(np.abs(ticks - expected) <= 1)

    def test_a_log_without_rest_has_none(self) -> None:
        moving = excerpt(flown(), 5.0, 6.0)
        assert waypoint_ticks(moving).tolist() == []
        desired_joints(moving)
        control_results(moving, "x")

    def test_both_ends_of_a_rest(self) -> None:
        log = flown(times=(0.0, 1.0, 2.0))
        log.reference_joints = np.insert(
            log.reference_joints, [2000] * 500, log.reference_joints[2000], axis=0
        )
        assert waypoint_ticks(log).tolist() == [0, 2000, 2500, 4499]


def hyphened(number: str) -> str:
    return number.replace("\u2212", "-")


class TestScales:
    @pytest.mark.parametrize(
        ("largest", "power"), [(0.8, ""), (3e-8, "1e-8"), (6.77e7, "1e7"), (1e300, "1e300")]
    )
    def test_a_power_of_ten_stands_once_above_its_axis(self, largest: float, power: str) -> None:
        log = flown(duration=1.0, error=0.0)
        log.applied_torque[:] = largest * np.linspace(-1.0, 1.0, 2000)[:, np.newaxis]
        figure = control_results(log, "x")
        with house_style():
            FigureCanvasAgg(figure).draw()
        axis = figure.axes[1].yaxis
        assert hyphened(axis.get_offset_text().get_text()) == power
        factor = float(power or 1.0)
        for tick in axis.get_major_ticks():
            shown = hyphened(tick.label1.get_text())
            assert len(shown) <= 6
            assert float(shown) * factor == pytest.approx(tick.get_loc(), abs=1e-9 * largest)


class TestSpectrum:
    def test_power_of_all_axes_is_kept(self) -> None:
        values = np.random.default_rng(3).normal(scale=[1.0, 2.0, 3.0], size=(60000, 3))
        frequency, density = power_spectral_density(values, PERIOD)
        assert np.sum(density) * frequency[0] == pytest.approx(14.0, rel=0.05)

    @pytest.mark.parametrize(
        ("samples", "length"), [(6000, 2048), (801, 801), (100, 100), (65, 65)]
    )
    def test_is_welchs_without_each_segments_trend(self, samples: int, length: int) -> None:
        values = np.cumsum(np.random.default_rng(1).normal(size=(samples, 3)), axis=0)
        f, expected = signal.welch(values, 1.0 / PERIOD, nperseg=length, detrend="linear", axis=0)
        frequency, density = power_spectral_density(values, PERIOD)
        np.testing.assert_allclose(frequency, f[1:], rtol=1e-12)
        np.testing.assert_allclose(density, expected[1:].sum(axis=1), rtol=1e-9)

    def test_a_tone_stands_out_of_slow_motion(self) -> None:
        time = np.arange(60000)[:, np.newaxis] * PERIOD
        values = np.sin(0.2 * time) + 1e-6 * np.sin(2.0 * np.pi * 300.0 * time)
        frequency, density = power_spectral_density(values, PERIOD)
        high = frequency > 100.0
        assert frequency[high][np.argmax(density[high])] == pytest.approx(300.0, abs=1.0)

    def test_what_has_none(self) -> None:
        assert len(power_spectral_density(np.ones((10, 3)), PERIOD)[0]) == 0
        values = np.ones((5000, 3))
        values[20:] = math.nan
        assert len(power_spectral_density(values, PERIOD)[0]) == 0
        assert np.isnan(power_spectral_density(np.zeros((5000, 3)), PERIOD)[1]).all()


class TestDesiredJoints:
    def test_draws_the_mission_in_degrees(self) -> None:
        log = flown()
        figure = desired_joints(log)
        (axes,) = figure.axes
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (s)", "desired joint angle (deg)")
        assert legend_names(figure) == [list(log.joint_names)]
        for joint in range(6):
            line = by_look(axes, joint)
            x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
            angle = np.degrees(log.reference_joints[:, 0, joint])
            np.testing.assert_allclose(y, angle[np.round(x / PERIOD).astype(int)], rtol=1e-12)
            marked = x[line.get_markevery()]
            np.testing.assert_allclose(marked, [0.0, 15.0, 29.9995])


class TestControlResults:
    def test_panels_hold_errors_and_torques_of_base_and_joints(self) -> None:
        log = flown(ripple=0.1)
        log.applied_torque[41111, 1] = 7.0  # one tick
        figure = control_results(log, "TDE-STC, case 1")
        assert [axes.get_ylabel() for axes in figure.axes] == [
            "attitude error (deg)",
            "base torque (N m)",
            "base torque (N m)",
            "joint error (rad)",
            "joint torque (N m)",
            "joint torque (N m)",
        ]
        assert figure.get_suptitle() == "TDE-STC, case 1"
        assert legend_names(figure) == [["base x", "base y", "base z"], list(log.joint_names)]
        error = tracking_error(log)
        drawn = [
            attitude_angles(log),
            log.applied_torque[:, :3],
            error[:, 3:],
            log.applied_torque[:, 3:],
        ]
        for place, values in zip((0, 1, 3, 4), drawn, strict=True):
            axes = figure.axes[place]
            assert len(curves(axes)) == values.shape[1]
            for axis in range(values.shape[1]):
                y = np.asarray(by_look(axes, axis).get_ydata())
                assert (y.min(), y.max()) == pytest.approx(
                    (values[:, axis].min(), values[:, axis].max())
                )
                assert y[[0, -1]] == pytest.approx(values[[0, -1], axis])

    def test_torques_are_enlarged_round_the_junction(self) -> None:
        log = flown()
        log.applied_torque[29990, 0] = 9.0
        axes = control_results(log, "").axes[2]
        line = by_look(axes, 0)
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        assert axes.get_xlabel() == "time from 15 s (ms)"
        assert (x[0], x[-1]) == pytest.approx((-150.0, 150.0))
        assert x[np.argmax(y)] == pytest.approx(-5.0)

    @pytest.mark.parametrize(
        ("times", "duration", "panels"),
        [
            (PAPER_TIMES, 5.0, 4),
            ((0.0, 1.0), None, 4),
            ((0.0, 1.0, 2.0, 3.0), None, 8),
            (tuple(np.arange(9.0).tolist()), None, 10),
        ],
    )
    def test_as_many_enlargements_as_junctions_up_to_three(
        self, times: tuple[float, ...], duration: float | None, panels: int
    ) -> None:
        figure = control_results(flown(times=times, duration=duration), "x")
        assert len(figure.axes) == panels
        per_side = (panels - 4) // 2
        for axes in figure.axes:
            if "s (ms)" in axes.get_xlabel():
                assert axes.get_xlabel().startswith("time from" if per_side < 3 else "from")
                shown = np.abs(axes.get_xticks()) <= 150.0
                assert shown.sum() == (7 if per_side == 1 else 3), "more would overlap"

    @pytest.mark.parametrize("n", [1, 7, 12])
    def test_any_number_of_joints(self, n: int) -> None:
        figure = control_results(flown(n, (0.0, 1.0, 2.0)), "x")
        assert len(curves(figure.axes[4])) == n
        assert len(legend_names(figure)[1]) == n

    @pytest.mark.filterwarnings("error")
    def test_a_flight_that_diverged(self, tmp_path: Path) -> None:
        log = flown(duration=0.0055)
        log.applied_torque[-3:, :] = [[1e7] * 9, [1e300] * 9, [math.inf] * 9]
        log.joint_positions[-1] = math.nan
        figure = control_results(log, "CTC, printed gains: diverged at tick 11")
        save_figure(figure, tmp_path / "diverged")

    def test_a_real_flight(self) -> None:
        log = simulate(Flight(resolve(FlightPlan(duration=0.1))))
        axes = control_results(log, "x").axes[1]
        y = np.asarray(by_look(axes, 2).get_ydata())
        np.testing.assert_allclose(y, log.applied_torque[:, 2], rtol=1e-12)


class TestComparisons:
    def test_junctions_have_one_scale_and_say_what_it_cuts_off(self) -> None:
        logs = {"TDE-SMC": flown(ripple=5.0), "TDE-TSMC": flown(ripple=0.02), "TDE-STC": flown()}
        figure = junctions(base_torques({**logs, "CTC": flown(duration=0.0055)}))
        smc, tsmc, stc, ctc = figure.axes
        assert len({axes.get_ylim() for axes in figure.axes}) == 1
        assert {axes.get_xlim() for axes in figure.axes} == {(-150.0, 150.0)}
        assert smc.get_title("left").startswith("TDE-SMC, cut: -")
        assert [a.get_title("left") for a in (tsmc, stc, ctc)] == ["TDE-TSMC", "TDE-STC", "CTC"]
        assert ctc.texts[0].get_text() == "ended at 0.0055 s"
        assert ctc.get_xlabel() == "time from 15 s (ms)"
        assert smc.get_ylabel() == "base torque x (N m)"
        y = np.asarray(by_look(tsmc, 0).get_ydata())
        shown = logs["TDE-TSMC"].applied_torque[29700:30301, 0]
        assert (y.min(), y.max()) == pytest.approx((shown.min(), shown.max()))

    def test_junctions_of_flights_without_any(self) -> None:
        figure = junctions(base_torques({"TDE-STC": flown(duration=1.0)}))
        assert figure.axes == []
        assert "None of these flights" in figure.get_suptitle()

    def test_chatter_shows_ticks_and_spectra(self) -> None:
        logs = {"TDE-SMC": flown(ripple=0.5), "TDE-STC": flown(), "CTC": flown(duration=0.0055)}
        figure = chatter(base_torques(logs))
        smc, stc, ctc, spectrum = figure.axes
        assert smc.get_ylim() == stc.get_ylim() == ctc.get_ylim()
        assert smc.get_xlabel() == "time from 7.5 s (ms)"
        for axis in range(3):
            line = by_look(smc, axis)
            assert line.get_drawstyle() == "steps-pre"
            np.testing.assert_array_equal(
                line.get_ydata(), logs["TDE-SMC"].applied_torque[15000:15101, axis]
            )
        rough, smooth = by_look(spectrum, 0), by_look(spectrum, 1)
        frequency = np.asarray(rough.get_xdata())
        high = frequency > 100.0
        assert np.all(np.asarray(rough.get_ydata())[high] > np.asarray(smooth.get_ydata())[high])
        assert spectrum.get_xscale() == spectrum.get_yscale() == "log"
        assert spectrum.get_ylabel() == "PSD of base torque, x + y + z ((N m)²/Hz)"
        (mark,) = (line for line in spectrum.get_lines() if line.get_linestyle() == ":")
        assert np.asarray(mark.get_xdata()).tolist() == [100.0, 100.0]
        assert legend_names(figure)[1] == ["TDE-SMC", "TDE-STC", "CTC: too short"]

    def test_a_loud_one_does_not_set_the_scale(self) -> None:
        quiet, loud = np.linspace(-1.0, 1.0, 9), np.array([-9.0, 9.0])
        assert common_limits([quiet, loud, 1.5 * quiet]) == pytest.approx((-1.65, 1.65))
        assert common_limits([np.array([math.nan])]) == (-1.0, 1.0)
        low, high = common_limits([np.zeros(5)])
        assert low < 0.0 < high


class TestPrint:
    def test_looks_differ_in_colour_and_marker(self) -> None:
        assert len({LineStyle.of(index)[:2] for index in range(63)}) == 63

    @pytest.mark.parametrize("n", [1, 7])
    def test_nothing_overlaps_or_leaves_the_page(self, n: int) -> None:
        names = tuple(f"upper_arm_{i}" for i in range(n))
        times = (0.0, 1.0, 2.0)
        log = flown(n, times, ripple=0.1, names=names)
        laws = ("CTC (printed)", "CTC-SMC (printed)", "TDE-SMC", "TDE-TSMC", "TDE-STC")
        flights = {law: BaseTorque.of(log) for law in laws}
        title = "TDE-STC, case 4-2, gains printed, friction, payload of 20 kg, disturbances " * 2
        for figure in (
            desired_joints(log),
            control_results(log, title),
            junctions(flights),
            chatter(flights),
            control_results(flown(n, (0.0, 1.0), error=0.0126), title),
        ):
            boxes = text_boxes(figure)
            page = figure.bbox
            for text, box in boxes:
                assert page.x0 <= box.x0, text
                assert page.y0 <= box.y0, text
                assert box.x1 <= page.x1, text
                assert box.y1 <= page.y1, text
            for index, (text, box) in enumerate(boxes):
                for other, other_box in boxes[:index]:
                    assert not box.overlaps(other_box), (text, other)

    def test_same_bytes_whatever_the_users_settings(self, tmp_path: Path) -> None:
        log = flown(times=(0.0, 0.5, 1.0))
        first = save_figure(desired_joints(log), tmp_path / "a" / "case_4.2")
        assert [path.name for path in first] == ["case_4.2.png", "case_4.2.svg"]
        with matplotlib.rc_context({"font.size": 20.0, "lines.linewidth": 5.0}):
            figure = desired_joints(log)
            second = save_figure(figure, tmp_path / "b")
            assert matplotlib.rcParams["font.size"] == 20.0
        again = save_figure(figure, tmp_path / "c")
        for one, two, three in zip(first, second, again, strict=True):
            assert one.read_bytes() == two.read_bytes() == three.read_bytes()

    def test_same_bytes_of_whole_flights(self, tmp_path: Path) -> None:
        for stem in ("a", "b"):
            save_figure(control_results(flown(times=(0.0, 0.5, 1.0)), "x"), tmp_path / stem)
        for suffix in (".png", ".svg"):
            files = [(tmp_path / stem).with_suffix(suffix) for stem in ("a", "b")]
            assert files[0].read_bytes() == files[1].read_bytes()

    def test_files_are_180_mm_wide_and_small(self, tmp_path: Path) -> None:
        log = flown(ripple=0.3, error=1e-9)
        log.joint_positions += 1e-9 * np.random.default_rng(1).normal(size=(60000, 6))
        png, svg = save_figure(control_results(log, "chatter everywhere"), tmp_path / "picture")
        header = png.read_bytes()[:24]
        assert header.startswith(b"\x89PNG")
        assert int.from_bytes(header[16:20], "big") == pytest.approx(180 / 25.4 * 150, abs=1)
        with Image.open(png) as image:
            assert image.info["dpi"] == pytest.approx((150.0, 150.0), rel=1e-3)
        root = ET.parse(svg).getroot()
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert float(root.attrib["width"].removesuffix("pt")) == pytest.approx(180 / 25.4 * 72)
        assert b"<image" not in svg.read_bytes()
        assert svg.stat().st_size < 400_000

    def test_svg_alone(self, tmp_path: Path) -> None:
        files = save_figure(desired_joints(flown()), tmp_path / "x", png=False)
        assert files == (tmp_path / "x.svg",)
        assert list(tmp_path.iterdir()) == [tmp_path / "x.svg"]

    def test_pyplot_stays_out_and_matplotlib_is_lazy(self) -> None:
        program = (
            "import sys\n"
            "import space_robot.analysis, space_robot.cli.main\n"
            "assert 'matplotlib' not in sys.modules\n"
            "import space_robot.analysis.figures\n"
            "assert 'matplotlib.pyplot' not in sys.modules\n"
        )
        subprocess.run([sys.executable, "-c", program], check=True)


def text_boxes(figure: Figure) -> list[tuple[str, Bbox]]:
    """Every text that is seen, with its box in pixels."""
    with house_style():
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        texts = list(figure.texts)
        texts += [text for legend in legends(figure) for text in legend.get_texts()]
        if figure._suptitle is not None:
            texts.append(figure._suptitle)
        for axes in figure.axes:
            texts += [axes.xaxis.label, axes.yaxis.label, axes._left_title, *axes.texts]
            texts += [axis.get_offset_text() for axis in (axes.xaxis, axes.yaxis)]
            for axis in (axes.xaxis, axes.yaxis):
                low, high = sorted(axis.get_view_interval())
                texts += [
                    tick.label1
                    for tick in axis.get_major_ticks()
                    if tick.label1.get_visible() and low <= tick.get_loc() <= high
                ]
        unique = {id(text): text for text in texts if text.get_text() and text.get_visible()}
        renderer = canvas.get_renderer()
        return [(text.get_text(), text.get_window_extent(renderer)) for text in unique.values()]
