"""The figures: what they draw is what was flown, readable, and of every flight that has it."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from benches import THRUSTER_PAIRS, hardware, still_log
from benches import WHEEL_AXES as PYRAMID
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image
from scipy import signal
from strategies import random_log, random_robot

from space_robot import Scenario
from space_robot.analysis import excerpt, tracking_error
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.errors import attitude_angles
from space_robot.analysis.figures import (
    chatter,
    control_results,
    desired_joints,
    errors_and_torques,
    junctions,
    kind_figure,
    latency_histogram,
    pointing,
    save_figure,
)
from space_robot.analysis.figures.base_torque import (
    BaseTorque,
    common_limits,
    power_spectral_density,
)
from space_robot.analysis.figures.figure_set import FigureSet
from space_robot.analysis.figures.overlay import FlightCurves, base_pointing
from space_robot.analysis.figures.style import (
    LineStyle,
    binned,
    house_style,
    legend_inside,
    page,
    plot_lines,
)
from space_robot.analysis.plotted import PlottedQuantity, flown_quantities
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
PAPER_TIMES = (0.0, 15.0, 30.0)
WHEELS = {"axes": PYRAMID, "max_momentum": [3.0], "max_torque": [0.5, 0.0, 0.5, 0.5]}
BOTH = hardware(wheels=WHEELS, thrusters=THRUSTER_PAIRS)
FREE = BaseActuatorSettings(base_actuation="none")


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
    start, *goals = angles.tolist()
    rows = zip(goals, np.diff(times).tolist(), strict=True)
    segments = [f"{{joints_deg: {goal}, duration: {span}}}" for goal, span in rows]
    settings = MissionSettings(joints_deg=start, segments=segments)
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


def data_of(line: Line2D) -> tuple[Array, Array]:
    return np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)


def curves(axes: Axes) -> list[Line2D]:
    """The lines of data, without the dotted upright ones."""
    return [line for line in axes.get_lines() if line.get_linestyle() != ":"]


def by_look(axes: Axes, index: int) -> Line2D:
    look = LineStyle.of(index)
    (found,) = (x for x in curves(axes) if (x.get_color(), x.get_marker()) == look[:2])
    return found


def same_color(rgb: Array, line: Line2D) -> bool:
    return bool(np.allclose(rgb, to_rgb(line.get_color())))


def legend_names(figure: Figure) -> list[list[str]]:
    """Of the figure, its parts and its panels."""
    legends = [*figure.legends, *(x for part in figure.subfigs for x in part.legends)]
    legends += [x for axes in figure.axes if (x := axes.get_legend()) is not None]
    return [[text.get_text() for text in legend.get_texts()] for legend in legends]


@given(
    arrays(np.float64, st.integers(1, 700), elements=st.floats(-1e9, 1e9) | st.just(math.nan)),
    st.integers(1, 60),
)
def test_bins_have_the_extremes_and_the_mean_of_their_samples(values: Array, length: int) -> None:
    columns = binned(np.arange(len(values), dtype=float), values[:, np.newaxis], length)
    assert {len(column) for column in columns} == {math.ceil(len(values) / length)}
    for number, (x, low, mean, high) in enumerate(zip(*columns, strict=True)):
        samples = values[number * length : (number + 1) * length]
        assert number * length <= x < number * length + len(samples)
        known = samples[np.isfinite(samples)]
        expected = [known.min(), known.mean(), known.max()] if len(known) else 3 * [math.nan]
        assert [*low, *mean, *high] == pytest.approx(expected, nan_ok=True, abs=1e-6)


def test_desired_joints_are_the_missions_in_degrees() -> None:
    log = flown()
    figure = desired_joints(log)
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (s)", "desired joint angle (deg)")
    assert legend_names(figure) == [list(log.joint_names)]
    for joint in range(6):
        line = by_look(axes, joint)
        x, y = data_of(line)
        angle = np.degrees(log.reference_joints[:, 0, joint])
        np.testing.assert_allclose(y, angle[np.round(x / PERIOD).astype(int)], atol=0.01)
        np.testing.assert_allclose(x[line.get_markevery()], [0.0, 15.0, 29.9995], atol=0.04)


def test_control_results_hold_errors_and_torques_of_base_and_joints() -> None:
    """Torques are enlarged round up to three junctions; one tick of 60,000 is seen."""
    log = flown(ripple=0.1)
    log.applied_torque[41111, 1] = 7.0
    log.applied_torque[29990, 0] = 9.0
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
    torque = log.applied_torque
    drawn = [attitude_angles(log), torque[:, :3], tracking_error(log)[:, 3:], torque[:, 3:]]
    for place, values in zip((0, 1, 3, 4), drawn, strict=True):
        axes = figure.axes[place]
        assert len(curves(axes)) == values.shape[1]
        for axis in range(values.shape[1]):
            _, y = data_of(line := by_look(axes, axis))
            column = values[:, axis]
            (area,) = (a for a in axes.collections if same_color(a.get_facecolor()[0, :3], line))
            drawn_y = area.get_paths()[0].vertices[:, 1]
            assert (drawn_y.min(), drawn_y.max()) == (column.min(), column.max())
            assert np.all((column.min() <= y) & (y <= column.max()))
    x, y = data_of(by_look(figure.axes[2], 0))
    assert figure.axes[2].get_xlabel() == "time from 15 s (ms)"
    assert (x[0], x[-1]) == pytest.approx((-150.0, 150.0))
    assert x[np.argmax(y)] == pytest.approx(-5.0)
    figure = control_results(flown(12, tuple(np.arange(9.0).tolist())), "x")
    assert (len(figure.axes), len(legend_names(figure)[1])) == (10, 12)


@pytest.mark.filterwarnings("error")
def test_flights_that_diverged_or_never_rest_are_drawn(tmp_path: Path) -> None:
    log = flown(duration=0.0055)
    log.applied_torque[-3:, :] = [[1e7] * 9, [1e300] * 9, [math.inf] * 9]
    log.joint_positions[-1] = math.nan
    save_figure(control_results(log, "CTC: diverged at tick 11"), tmp_path / "diverged")
    moving = excerpt(flown(), 5.0, 6.0)
    assert desired_joints(moving).axes
    assert len(control_results(moving, "x").axes) == 4


def test_junctions_have_one_scale_and_say_what_it_cuts_off() -> None:
    logs = {"TDE-SMC": flown(ripple=5.0), "TDE-TSMC": flown(ripple=0.02), "TDE-STC": flown()}
    logs["CTC"] = flown(duration=0.0055)
    figure = junctions({name: BaseTorque.of(log) for name, log in logs.items()})
    smc, tsmc, stc, ctc = figure.axes
    assert len({axes.get_ylim() for axes in figure.axes}) == 1
    assert {axes.get_xlim() for axes in figure.axes} == {(-150.0, 150.0)}
    assert smc.get_title("left").startswith("TDE-SMC, cut: -")
    assert [a.get_title("left") for a in (tsmc, stc, ctc)] == ["TDE-TSMC", "TDE-STC", "CTC"]
    assert ctc.texts[0].get_text() == "ended at 0.0055 s"
    _, y = data_of(by_look(tsmc, 0))
    shown = logs["TDE-TSMC"].applied_torque[29700:30301, 0]
    assert (y.min(), y.max()) == pytest.approx((shown.min(), shown.max()))
    assert not junctions({"TDE-STC": BaseTorque.of(flown(duration=1.0))}).axes


def test_chatter_shows_ticks_and_spectra() -> None:
    logs = {"TDE-SMC": flown(ripple=0.5), "TDE-STC": flown(), "CTC": flown(duration=0.0055)}
    figure = chatter({name: BaseTorque.of(log) for name, log in logs.items()})
    smc, stc, ctc, spectrum = figure.axes
    assert smc.get_ylim() == stc.get_ylim() == ctc.get_ylim()
    assert smc.get_xlabel() == "time from 7.5 s (ms)"
    for axis in range(3):
        line = by_look(smc, axis)
        assert line.get_drawstyle() == "steps-pre"
        drawn = logs["TDE-SMC"].applied_torque[15000:15101, axis]
        np.testing.assert_array_equal(line.get_ydata(), drawn)
    frequency, rough = data_of(by_look(spectrum, 0))
    above, torque = frequency > 100.0, logs["TDE-SMC"].applied_torque[:, :3]
    f, expected = signal.welch(torque, 1.0 / PERIOD, nperseg=2048, detrend="linear", axis=0)
    np.testing.assert_allclose(frequency, f[1:], rtol=1e-12)
    np.testing.assert_allclose(rough, expected[1:].sum(axis=1), rtol=1e-9)
    assert np.all(rough[above] > data_of(by_look(spectrum, 1))[1][above])
    assert spectrum.get_xscale() == spectrum.get_yscale() == "log"
    assert legend_names(figure)[1] == ["TDE-SMC", "TDE-STC", "CTC: too short"]
    broken = np.full((5000, 3), math.nan)
    assert len(power_spectral_density(broken, PERIOD)[0]) == 0
    assert common_limits([broken]) == (-1.0, 1.0)


def test_panels_and_legends_stay_apart_and_on_the_page() -> None:
    names = tuple(f"upper_arm_{i}" for i in range(7))
    log = flown(7, (0.0, 1.0, 2.0), ripple=0.1, names=names)
    laws = ("CTC (printed)", "CTC-SMC (printed)", "TDE-SMC", "TDE-TSMC", "TDE-STC")
    flights = {law: BaseTorque.of(log) for law in laws}
    title = "TDE-STC, case 4-2, gains printed, friction, payload of 20 kg, disturbances " * 2
    one, two = ({"width": width} for width in (88.9, 181.9))
    drawn = [control_results(log, title)]
    for size in (one, two):
        drawn += [desired_joints(log, **size), control_results(log, "", **size)]
        drawn += [junctions(flights, **size), chatter(flights, **size)]
    for figure in drawn:
        with house_style():
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            boxes = [x.get_tightbbox(canvas.get_renderer()) for x in figure.axes]
        parts = [figure, *figure.subfigs]
        boxes += [x.get_window_extent() for part in parts for x in (*part.legends, *part.texts)]
        for index, box in enumerate(boxes):
            assert min(box.x0, box.y0) >= 0.0
            assert box.x1 <= figure.bbox.x1
            assert box.y1 <= figure.bbox.y1
            assert not any(box.overlaps(other) for other in boxes[:index])


def test_files_are_180_mm_wide_small_and_the_same_bytes_whatever_the_users_settings(
    tmp_path: Path,
) -> None:
    assert len({LineStyle.of(index)[:2] for index in range(63)}) == 63
    log = flown(ripple=0.3, error=1e-9)
    log.joint_positions += 1e-9 * np.random.default_rng(1).normal(size=(60000, 6))
    first = save_figure(control_results(log, "chatter everywhere"), tmp_path / "a" / "case_4.2")
    with Image.open(first[0]) as image:
        assert image.size[0] == pytest.approx(180 / 25.4 * 150, abs=1)
        assert image.info["dpi"] == pytest.approx((150.0, 150.0), rel=1e-3)
    assert first[1].stat().st_size < 500_000
    assert [path.name for path in first] == ["case_4.2.png", "case_4.2.svg"]
    pdf = ("pdf",)
    first += save_figure(control_results(log, "chatter everywhere"), tmp_path / "a" / "p", pdf)
    assert b"/FontFile2" in (content := first[2].read_bytes())
    assert b"/Type3" not in content
    assert b"Date" not in content
    with matplotlib.rc_context({"font.size": 20.0, "lines.linewidth": 5.0}):
        second = save_figure(control_results(log, "chatter everywhere"), tmp_path / "b")
        second += save_figure(control_results(log, "chatter everywhere"), tmp_path / "p", pdf)
        assert matplotlib.rcParams["font.size"] == 20.0
    for one, two in zip(first, second, strict=True):
        assert one.read_bytes() == two.read_bytes()
    alone = save_figure(desired_joints(log), tmp_path / "svg" / "x", ["svg"])
    assert list((tmp_path / "svg").iterdir()) == [*alone] == [tmp_path / "svg" / "x.svg"]


@pytest.fixture(scope="module")
def overlaid() -> dict[str, FlightCurves]:
    found = {}
    for law in ("tde_stc", "ctc", "tde_smc"):
        log = Scenario(controller=law, duration=0.3).fly().log
        log.latency_s = None if law == "ctc" else np.linspace(1e-4, 2e-3, log.ticks)
        found[law] = FlightCurves.of(excerpt(log, 0.1, None))
    return found


def test_each_panel_has_a_line_a_flight_over_its_time(overlaid: dict[str, FlightCurves]) -> None:
    """The smoothest in front; a logarithmic one without the few values below its foot."""
    for figure, panels in ((errors_and_torques(overlaid), 6), (pointing(overlaid), 4)):
        assert len(figure.axes) == panels
        for axes in figure.axes:
            assert len(axes.get_lines()) == 3
            assert axes.get_xlim() == pytest.approx((0.1, 0.3), abs=0.01)
        assert legend_names(figure)[0] == list(overlaid)
    error, torque = errors_and_torques(overlaid).axes[:2]
    rough = {x.get_color(): np.nansum(np.abs(np.diff(data_of(x)[1]))) for x in torque.get_lines()}
    front = max(torque.get_lines(), key=lambda line: line.get_zorder())
    assert rough[front.get_color()] == min(rough.values())
    assert error.get_yscale() == "log"
    sizes = [curves.sizes[0][1].size for curves in overlaid.values()]
    lowest = min(np.percentile(size[size > 0.0], 0.5) for size in sizes)
    assert error.get_ylim()[0] == pytest.approx(0.5 * lowest)
    assert error.get_ylabel() == "attitude error (deg)"
    unknown = {
        name: curves._replace(
            sizes=[(kind, size) for kind, size in curves.sizes if kind == "joints"]
        )
        for name, curves in overlaid.items()
    }
    assert not pointing(unknown).axes
    drawn = base_pointing(overlaid)
    assert [axes.get_title("right") for axes in drawn.axes] == ["limit 360"] * 3


def test_the_histogram_counts_every_answer(overlaid: dict[str, FlightCurves]) -> None:
    figure = latency_histogram(overlaid)
    (axes,) = figure.axes
    steps = [patch.get_data() for patch in axes.patches]  # type: ignore[attr-defined]
    assert [step.values.sum() for step in steps] == [400, 400]
    assert steps[0].edges[[0, -1]] == pytest.approx((0.1 + 1.9 / 3.0, 2.0), rel=2e-3)
    assert legend_names(figure)[0] == ["tde_stc", "tde_smc"]
    assert not latency_histogram({"ctc": overlaid["ctc"]}).axes
    same = overlaid["tde_stc"]._replace(latency_ms=np.zeros(30))
    (patch,) = latency_histogram({"same": same}).axes[0].patches
    assert patch.get_data().values.sum() == 30  # type: ignore[attr-defined]


def lively_log(robot: Robot, actuators: BaseActuatorSettings, ticks: int = 50) -> FlightLog:
    log, rng = still_log(robot, ticks, actuators), np.random.default_rng(1)
    for name in ("omega_base", "joint_velocities", "wheel_velocities", "wheel_torques"):
        getattr(log, name)[:] = rng.normal(size=getattr(log, name).shape)
    log.thrusts[:] = 2.0 * (rng.random(log.thrusts.shape) < 0.5)
    return log


def figure_of(log: FlightLog, kind: str) -> tuple[Figure, list[PlottedQuantity]]:
    """The figure of a kind, and the quantities on it."""
    found = [q for _, q in flown_quantities(AnalysedLog(log), [kind]) if q.is_drawn]
    return kind_figure(log, found), found


@pytest.mark.parametrize("ticks", [1, 1300])
def test_the_raster_is_dark_where_a_thruster_is_open(paper_robot: Robot, ticks: int) -> None:
    log = lively_log(paper_robot, hardware(thrusters=THRUSTER_PAIRS), ticks)
    pulses, used, _ = figure_of(log, "thrusters")[0].axes
    (image,) = pulses.get_images()
    shown = np.asarray(image.get_array())
    length = -(-ticks // shown.shape[1])
    assert shown.shape[0] == 12
    for column in (0, shown.shape[1] - 1):
        part = log.thrusts[column * length : (column + 1) * length] / 2.0
        np.testing.assert_allclose(shown[:, column], part.mean(axis=0))
    (curve,) = used.get_lines()
    total = log.thrusts.sum() * log.timebase.period / (220.0 * 9.80665)
    assert data_of(curve)[1][-1] == pytest.approx(1e3 * total)


@pytest.mark.filterwarnings("ignore:Data has no positive values")
def test_of_several_flights_each_has_its_own(paper_robot: Robot, tmp_path: Path) -> None:
    """A free base has no torque and drift in the place of errors; a bag may lie about its base.

    Thrusters that never fired gave no torque at all, which has no spectrum.
    """
    still, names = FigureSet(), {"momentum", "wheels", "thrusters", "limit_cycle"}
    still.add("one", still_log(paper_robot, 100, BOTH))
    assert names <= {name for name, drawing in still.drawings().items() if drawing.draw().axes}
    lying = lively_log(paper_robot, FREE)
    lying.flight["base_actuators"] = hardware(wheels=WHEELS).model_dump()
    alone = FigureSet()
    alone.add("free", lively_log(paper_robot, FREE))
    saved = {f.files[1].stem: f.files[1].read_text("utf-8") for f in alone.save(tmp_path)}
    assert not {"junctions", "chatter"} & {*saved}
    assert "attitude drift" in saved["control_results"]
    figures = FigureSet()
    for name, log in {
        "ideal": random_log(6, 400, 0),
        "wheels": lively_log(paper_robot, hardware(wheels=WHEELS)),
        "free": lively_log(paper_robot, FREE),
        "lying": lying,
    }.items():
        figures.add(name, log)
    drawings = figures.drawings()
    empty = {name for name, drawing in drawings.items() if not drawing.draw().axes}
    assert empty == {"latency", "ripple"}
    own = [d.caption for name, d in drawings.items() if name.startswith(("momentum_", "wheels_"))]
    assert [caption.rpartition(" of ")[2] for caption in own] == ["wheels", "wheels", "free"]
    assert {"junctions", "chatter"} <= {*drawings}


def test_a_limit_is_a_line_unless_it_would_set_the_scale(paper_robot: Robot) -> None:
    log = lively_log(paper_robot, BOTH)
    values = np.sin(log.time)[:, np.newaxis] / np.sin(log.time[-1])
    figure = kind_figure(
        log, [PlottedQuantity("x", "N", ["joint3"], values, limits=(50.0, 0, 1.5))]
    )
    (axes,) = figure.axes
    assert [data_of(line)[1][0] for line in axes.get_lines()[1:]] == [-1.5, 1.5]
    assert axes.get_title("right") == "limit 50"
    assert axes.get_lines()[0].get_color() == LineStyle.of(2).colour


def test_a_legend_is_inside_where_nothing_is_and_above_elsewhere() -> None:
    time = np.linspace(0.0, 1.0, 200)
    for height, is_inside in ((0.05, True), (1.0, False)):
        with house_style():
            figure = page(60.0)
            axes = figure.subplots()
            axes.set_ylim(-1.0, 1.0)
            plot_lines(axes, time, height * np.sin(300.0 * time)[:, np.newaxis])
            legend_inside(axes, ["x"], dashed=True)
            figure.draw_without_rendering()
        (box,) = (axes.get_legend().get_window_extent(),)  # type: ignore[union-attr]
        assert (box.y1 < axes.bbox.y1) == is_inside
