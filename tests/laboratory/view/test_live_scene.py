"""The live scene: what a browser is sent of a graph are the poses that its bag has."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import forked_space_robot, space_robot_here
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.view.live import serve as serving
from space_robot.view.live.serve import LiveOptions, serve
from space_robot.view.wheels import slowdown_of
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.transforms import joint_transforms
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

msgspec = pytest.importorskip("msgspec")
pytest.importorskip("viser")
zstandard = pytest.importorskip("zstandard")
websockets = pytest.importorskip("websockets.sync.client")

Array = NDArray[np.float64]
Poses = dict[str, tuple[float, ...]]
TIMEOUT_S = 120.0
CLOSE = 3e-5
"""viser sends no pose again that has changed by less than a hundred-thousandth."""
WINDOW = 128
"""Messages that viser sends at once: of more that belong together the rest comes in the next."""
Z = np.array([0.0, 0.0, 1.0])
ORIGIN, UNTURNED = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
"""Of a frame whose position or attitude nobody has sent."""
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (5.0, 5.0, 5.0),
    "fov": 1.0,
    "near": 0.1,
    "far": 100.0,
    "image_height": 100,
    "image_width": 100,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class EndedError(Exception):
    """The test has seen enough."""


class Server(threading.Thread):
    """Serves in a thread until it has waited for flights so many times."""

    def __init__(self, domain: int, flights: int) -> None:
        super().__init__(daemon=True)
        self._options, self._left = LiveOptions(domain=domain, port=0), flights + 1
        self.lines: list[str] = []
        self.address = ""
        self.waits = threading.Event()
        self.error: BaseException | None = None

    def run(self) -> None:
        try:
            serve(self._options, self._say, self._set_address)
        except BaseException as error:
            self.error = error

    def _say(self, line: str) -> None:
        self.lines.append(line)
        if line == serving.WAITING:
            self._left -= 1
            self.waits.set()
            if not self._left:
                raise EndedError

    def _set_address(self, address: str) -> None:
        self.address = address


def frames(server: Server) -> Iterator[Poses]:
    """Yield all poses that a browser is shown, by name in the scene, after each change."""
    import viser

    poses: Poses = {}
    before: Poses = {}
    with websockets.connect(
        server.address.replace("http", "ws"),
        subprotocols=[f"viser-v{viser.__version__}"],
        max_size=None,
    ) as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))  # a browser without one is none yet
        while server.is_alive():
            try:
                data = socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            except Exception:  # the server is gone
                return
            received = messages(data)
            for message in received:
                if message["type"] == "FrameMessage":
                    for part in ("Pos", "Ori"):
                        poses.pop(part + message["name"], None)
                if message["type"] in ("SetPositionMessage", "SetOrientationMessage"):
                    value = message.get("position", message.get("wxyz"))
                    poses[f"{message['type'][3:6]}{message['name']}"] = tuple(value)
            if poses != before and len(received) < WINDOW:
                before = dict(poses)
                yield dict(poses)


def messages(data: bytes) -> list[dict[str, Any]]:
    """Decode what viser sends at once."""
    size = int.from_bytes(data[8:16], "little")
    inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
    found: list[dict[str, Any]] = msgspec.msgpack.decode(inner)["messages"]
    return found


def fly(domain: int, bag: Path, shown: list[Poses], *options: str) -> FlightLog:
    """Fly by the wall clock, once the first steps have been shown."""

    def sim(*words: str) -> bool:
        return space_robot_here("sim", *words, "--domain", str(domain)).returncode == 0

    where = ("--domain", str(domain), "--bag", str(bag))
    how = ("--paused", "--realtime", "--duration", "1")
    with forked_space_robot("fly", *how, *where, *options) as process:
        until = time.monotonic() + TIMEOUT_S
        while not (sim("step", "--ticks", "50") and any(is_robot_in(poses) for poses in shown)):
            assert time.monotonic() < until
        assert sim("resume")
        _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    return read_flight(bag)


def is_robot_in(poses: Poses) -> bool:
    return any(name.startswith("Ori/robot/base_link/") for name in poses)


def shown_rows(log: FlightLog, shown: list[Poses]) -> list[int]:
    """Return the row of the log that each frame shows; fail where there is none."""
    rests = {"Pos/robot/base_link": ORIGIN, "Ori/robot/base_link": UNTURNED}
    truths = [log.base_position, log.quaternion]
    path = "/robot/base_link"
    for link in joint_transforms(find_robot("paper"), log.joint_positions):
        path = f"{path}/{link.child}"
        rests[f"Ori{path}"] = UNTURNED
        truths.append(link.quaternion)
    truth = np.hstack(truths)
    rows = []
    for poses in shown:
        if not is_robot_in(poses):
            continue
        seen = np.concatenate([poses.get(name, rest) for name, rest in rests.items()])
        away = np.abs(truth - seen).max(axis=1)
        rows.append(int(away.argmin()))
        assert away[rows[-1]] < CLOSE
    return rows


def unit_rows(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def turn(poses: Poses, name: str) -> tuple[float, ...]:
    return poses.get(f"Ori/robot/{name}", UNTURNED)


def test_a_flight_is_shown_as_it_is_in_truth(tmp_path: Path, free_domain: int) -> None:
    """In orbit, with wheels, and sensors so far off that their poses are none of the truth's."""
    server = Server(free_domain, 1)
    server.start()
    assert server.waits.wait(TIMEOUT_S)
    shown: list[Poses] = []

    def watch() -> None:
        shown.extend(frames(server))

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    how = ("--orbit", "iss", "--actuators", "wheels", "--sensors", "tactical")
    log = fly(free_domain, tmp_path / "bag", shown, *how)
    server.join(TIMEOUT_S)
    watcher.join(TIMEOUT_S)
    assert isinstance(server.error, EndedError)
    following = f"following the flight in ROS domain {free_domain}"
    robot, showing = "its robot is paper; waiting for its first state", "showing it from "
    lines = [line for line in server.lines if not line.startswith("still ")]
    assert [showing if line.startswith(showing) else line for line in lines] == [
        *(serving.WAITING, following, robot, showing, serving.OVER, serving.WAITING)
    ]
    rows = shown_rows(log, shown)
    assert len(set(rows)) > 3
    assert rows == sorted(rows)
    last = shown[-1]
    nadir, velocity = (
        Rotation.from_quat(turn(last, f"orbit/{name}"), scalar_first=True).apply(Z)
        for name in ("nadir", "orbital_velocity")
    )
    away = np.abs(nadir + unit_rows(log.orbit_position)).max(axis=1)
    row = int(away.argmin())
    assert row > log.ticks // 2
    assert away[row] < CLOSE
    np.testing.assert_allclose(velocity, unit_rows(log.orbit_velocity)[row], atol=CLOSE)
    earth = np.array(last["Pos/earth"])  # from the middle of the scene
    np.testing.assert_allclose(unit_rows(earth), nadir, atol=1e-3)
    turns = np.array([turn(last, f"base_link/wheel_{k + 1}/rotor") for k in range(4)])
    assert not turns[:, 1:3].any()
    turned = 2.0 * np.arctan2(turns[:, 3], turns[:, 0])
    largest = 20.0 / 0.0318  # momentum and rotor's inertia of config/actuators/wheels.yaml
    angles = log.timebase.period * np.cumsum(log.wheel_velocities, axis=0) / slowdown_of(largest)
    wrong = np.abs(angles - turned).max(axis=1)
    assert np.abs(angles[-1]).max() > 0.02
    assert wrong.min() < 0.1 * np.abs(angles[-1]).max() + 1e-3
    assert int(wrong.argmin()) > log.ticks // 2


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
