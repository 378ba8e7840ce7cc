"""The live scene: what is shown of a graph are the states that its bag has."""

from __future__ import annotations

import signal
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import forked_space_robot, space_robot_here
from scipy.spatial.transform import Rotation

from space_robot.view.live import serve as serving
from space_robot.view.live.listener import Sample
from space_robot.view.live.serve import LiveOptions, serve
from space_robot.view.live.view import LiveView
from space_robot_model.robot.placements import joint_transforms
from space_robot_msgs_py.bag.reader import read_flight

TIMEOUT_S = 120.0


def test_a_flight_is_shown_as_it_is_in_truth(
    tmp_path: Path, free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In orbit, with wheels, and sensors so far off that their poses are none of the truth's."""
    samples: list[Sample] = []
    views: list[Any] = []

    class Seen(LiveView):
        def show(self, sample: Sample) -> None:
            super().show(sample)
            samples.append(sample)
            views.append(self)

    monkeypatch.setattr(serving, "LiveView", Seen)
    lines: list[str] = []
    waits = threading.Event()

    def say(line: str) -> None:
        lines.append(line)
        if line == serving.WAITING and waits.is_set():
            raise EOFError
        waits.set()

    def run() -> None:
        try:
            serve(LiveOptions(domain=free_domain, port=0), say, lambda address: None)
        except EOFError:  # the test has seen enough
            lines.append("ended")

    server = threading.Thread(target=run, daemon=True)
    server.start()
    assert waits.wait(TIMEOUT_S)
    what = ("--orbit", "iss", "--actuators", "wheels", "--sensors", "tactical")
    how = ("--paused", "--realtime", "--duration", "1", "--bag", str(tmp_path / "bag"))
    where = ("--domain", str(free_domain))
    with forked_space_robot("fly", *what, *how, *where) as process:
        until = time.monotonic() + TIMEOUT_S
        while not samples:  # it steps until the first state is shown
            assert time.monotonic() < until
            space_robot_here("sim", "step", "--ticks", "20", *where)
        assert space_robot_here("sim", "resume", *where).returncode == 0
        _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    server.join(TIMEOUT_S)
    assert [line.partition(" from")[0] for line in lines if "still " not in line] == [
        serving.WAITING,
        f"following the flight in ROS domain {free_domain}",
        "its robot is paper; waiting for its first state",
        "showing it",
        serving.OVER,
        serving.WAITING,
        "ended",
    ]
    log, view = read_flight(tmp_path / "bag"), views[-1]
    rows = [round(sample.time / log.timebase.period) for sample in samples]
    assert len(set(rows)) > 3
    assert rows == sorted(rows)
    for row, sample in zip(rows, samples, strict=True):
        np.testing.assert_array_equal(sample.base_position, log.base_position[row])
        np.testing.assert_allclose(sample.torque, log.applied_torque[row], atol=1e-9)
    row, sample = rows[-1], samples[-1]
    close = {"rtol": 0.0, "atol": 3e-5}  # viser sends no smaller changes
    np.testing.assert_allclose(view._scene.base.position, log.base_position[row], **close)
    np.testing.assert_allclose(view._scene.base.wxyz, log.quaternion[row], **close)
    for link in joint_transforms(view._robot, log.joint_positions[[row, row]]):
        shown = view._scene._frames[link.child].wxyz
        np.testing.assert_allclose(shown, link.quaternion[0], **close)
    assert sample.orbit is not None
    away = sample.orbit[:3] / np.linalg.norm(sample.orbit[:3])
    nadir = Rotation.from_quat(view._orbit._arrows._nodes[0].wxyz, scalar_first=True)
    np.testing.assert_allclose(nadir.apply([0.0, 0.0, 1.0]), -away, **close)
    newest = np.abs(log.orbit_position - sample.orbit[:3]).max(axis=1)
    assert newest.min() == 0.0
    assert abs(int(newest.argmin()) - row) < 50
    actuators, turned = view._actuators, np.zeros(4)
    for before, after in pairwise(samples):
        turned += (after.time - before.time) * after.wheels[0] / actuators._slowdown
        speeds = np.abs(log.wheel_velocities - after.wheels[0]).max(axis=1)
        assert speeds.min() == 0.0
    assert turned.any()
    np.testing.assert_allclose(actuators._angles, turned, rtol=1e-9)


def test_ctrl_c_ends_it(free_domain: int) -> None:
    options = ("--live", "--no-open", "--port", "0", "--domain", str(free_domain))
    with forked_space_robot("view", *options) as process:
        assert process.stderr is not None
        assert process.stderr.readline().strip() == "starting the scene ..."
        address, waiting = process.stderr.readline(), process.stderr.readline()
        assert address.startswith("the scene is at http://127.0.0.1:")
        assert waiting.strip() == serving.WAITING
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=TIMEOUT_S)[1].strip() == "ended"
        assert process.returncode == 0
