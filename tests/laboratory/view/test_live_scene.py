"""The live scene: what is shown of a graph are the states that its bag has."""

from __future__ import annotations

import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import forked_space_robot, space_robot_here

from space_robot.analysis import tracking_error
from space_robot.view import live
from space_robot.view.live import LiveView, serve
from space_robot_model.robot.placements import joint_transforms
from space_robot_msgs_py.bag.reader import read_flight

TIMEOUT_S = 240.0


def test_a_flight_is_shown_as_it_is_in_truth(
    tmp_path: Path, free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With wheels, and sensors so far off that their poses are none of the truth's."""
    shown: list[tuple[float, Any]] = []
    views: list[LiveView] = []

    class Seen(LiveView):
        def show(self) -> None:
            super().show()
            columns = {name: column[-1].copy() for name, column in self._feed.log.columns.items()}
            shown.append((self._feed.time[-1], columns))
            views.append(self)

    monkeypatch.setattr(live, "LiveView", Seen)
    lines: list[str] = []
    waits = threading.Event()

    def run() -> None:
        for line in serve(free_domain, "", 0, True, ("wheels", "joints")):
            lines.append(line)
            if line == live.WAITING and waits.is_set():
                return
            if line == live.WAITING:
                waits.set()

    server = threading.Thread(target=run, daemon=True)
    server.start()
    assert waits.wait(TIMEOUT_S)
    what = ("--orbit", "iss", "--actuators", "wheels", "--sensors", "tactical")
    how = ("--paused", "--realtime", "--duration", "1", "--bag", str(tmp_path / "bag"))
    where = ("--domain", str(free_domain))
    with forked_space_robot("fly", *what, *how, *where) as process:
        until = time.monotonic() + TIMEOUT_S
        while not shown:  # it steps until the first state is shown
            assert time.monotonic() < until
            space_robot_here("sim", "step", "--ticks", "20", *where)
        assert space_robot_here("sim", "resume", *where).returncode == 0
        _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    server.join(TIMEOUT_S)
    following = f"following the flight in / of ROS domain {free_domain}"
    assert lines[1:] == [live.WAITING, following, live.OVER, live.WAITING]
    log, view = read_flight(tmp_path / "bag"), views[-1]
    rows = [round(stamp / log.timebase.period) for stamp, _ in shown]
    assert len(set(rows)) > 3
    assert rows == sorted(rows)
    wheels = []
    for row, (_, columns) in zip(rows, shown, strict=True):
        np.testing.assert_array_equal(columns["base_position"], log.base_position[row])
        np.testing.assert_allclose(columns["applied_torque"], log.applied_torque[row], atol=1e-9)
        newest = np.abs(log.wheel_velocities - columns["wheel_velocities"]).max(axis=1)
        wheels.append(newest.min())
    assert np.nanmax(wheels) == 0.0, "a busy machine shows the first states before their wheels"
    row, close = rows[-1], {"rtol": 0.0, "atol": 3e-5}  # viser sends no smaller changes
    np.testing.assert_allclose(view._robot.base.position, log.base_position[row], **close)
    np.testing.assert_allclose(view._robot.base.wxyz, log.quaternion[row], **close)
    for link in joint_transforms(view._feed.robot, log.joint_positions[[row, row]]):
        shown_turn = view._robot._frames[link.child].wxyz
        np.testing.assert_allclose(shown_turn, link.quaternion[0], **close)
    known = np.isfinite(view._feed.time)
    drawn = tracking_error(view._feed.log)[known][:, 3:]
    at = np.flatnonzero(np.isfinite(drawn).all(axis=1))[-1]  # a state may come before its reference
    row = round(view._feed.time[known][at] / log.timebase.period)
    np.testing.assert_allclose(drawn[at], tracking_error(log)[row, 3:], atol=1e-9)
    kinds = {label: plot.visible for label, (_, _, plot) in view._plots.items()}
    assert kinds["wheel momentum (N m s)"]
    assert not kinds["attitude error (deg)"]
    *_, plot = view._plots["joints 1-3 error (rad)"]
    assert len(plot.data[0]) == known.sum()


def test_ctrl_c_ends_it(free_domain: int) -> None:
    options = ("--live", "--no-open", "--port", "0", "--domain", str(free_domain))
    with forked_space_robot("view", *options) as process:
        assert process.stderr is not None
        assert process.stderr.readline().strip() == "starting the scene ..."
        address, waiting = process.stderr.readline(), process.stderr.readline()
        assert address.startswith("the scene is at http://127.0.0.1:")
        assert waiting.strip() == live.WAITING
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=TIMEOUT_S)[1].strip() == "ended"
        assert process.returncode == 0
