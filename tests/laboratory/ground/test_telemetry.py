"""Telemetry of flights and bags, read with LASP's parser from the XTCE database alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from telemetry_packets import check_equal, expected, packets_in

from space_robot import Scenario
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames, Timebase
from space_robot_msgs_py.telemetry.downlink import cuc_time
from space_robot_msgs_py.telemetry.structures import TELEMETERED, Structures, TelemetrySettings

pytest.importorskip("spacepackets")
NAMES = RobotNames(("a", "b"))


@pytest.mark.parametrize(
    ("options", "rate_hz"),
    [
        ({"actuators": "wheels", "sensors": "fine", "swaps": ["0.2:ctc"]}, 10.0),
        ({"robot": "flexible_panels", "telemetry_packets": "fast"}, 100.0),
    ],
    ids=["wheels", "panels"],
)
def test_every_number_is_that_of_the_log(
    options: dict[str, Any], rate_hz: float, tmp_path: Path
) -> None:
    file, duration = tmp_path / "a.packets", 0.5
    flown = Scenario(duration=duration, telemetry=str(file), **options).fly()
    packets = packets_in(file)
    names = {p["structure"] for p in packets if p["pus_service"] == 3}
    assert len([p for p in packets if "structure" in p]) == len(names) * duration * rate_hz
    assert check_equal(file, flown.log) > 100
    events = [(p["time"], str(p["law"])) for p in packets if p["pus_service"] == 5]
    assert [law for _, law in events] == [law.name for law in flown.log.laws]
    assert [p["ccsds_sequence_count"] for p in packets] == list(range(len(packets)))


def test_a_bag_gives_the_packets_of_its_flight(tmp_path: Path, space_robot: Any) -> None:
    file, bag = tmp_path / "a.packets", tmp_path / "bag"
    options = {"actuators": "wheels", "swaps": ["0.3:ctc"], "faults": ["noise_gyro@0.1:1e-6"]}
    Scenario(duration=0.5, telemetry=str(file), **options).fly(bag=bag)
    again = tmp_path / "b.packets"
    ran = space_robot("telemetry", bag, "-o", again, "--json")
    assert json.loads(ran.out)["packets"] == len(packets_in(file))
    assert again.read_bytes() == file.read_bytes()
    assert again.with_suffix(".xml").read_text() == file.with_suffix(".xml").read_text()
    assert check_equal(again, read_flight(bag)) > 100


def test_integers_are_calibrated_within_half_a_count(tmp_path: Path) -> None:
    file = tmp_path / "a.packets"
    log = Scenario(duration=3.0, telemetry=str(file), telemetry_packets="low_rate").fly().log
    for packet in packets_in(file):
        if packet["pus_service"] == 3:
            values = expected(log, packet["tick"])
            assert abs(packet["quaternion_w"] - values["quaternion_w"]) <= 2.5e-5
            for joint in log.joint_names:
                name = f"joint_positions_{joint}"
                assert abs(packet[name] - values[name]) <= 1e-4


def test_a_controller_that_answers_messages_reports_its_modes(tmp_path: Path) -> None:
    file = tmp_path / "a.packets"
    parameters = {"controller": {"hold_ticks": 2}}
    Scenario(
        duration=0.6, telemetry=str(file), faults=["nan_state@0.2-0.4:1"], parameters=parameters
    ).fly()
    entered = [p for p in packets_in(file) if p.get("event") == "mode_entered"]
    modes = [(str(p["mode"]), p["pus_subtype"]) for p in entered]
    assert modes[0] == ("holding", 3)
    assert modes[-1] == ("nominal", 1)
    assert ("safe", 4) in modes
    assert all(0.19 < p["time"] <= 0.41 for p in entered)


def test_limits_of_the_robot_are_in_the_database(tmp_path: Path) -> None:
    from space_robot.ground.decoder import Decoder

    file = tmp_path / "a.packets"
    faults, events = ["drive_scale@0.01-0.02:all=0.9"], ["capture@0.03:small_satellite"]
    options = {"robot": "canadarm", "actuators": "wheels", "faults": faults, "events": events}
    flown = Scenario(duration=0.05, telemetry=str(file), **options).fly()
    catalogue = Decoder(file.with_suffix(".xml")).catalogue()
    limits = {p["name"]: p for each in catalogue["structures"] for p in each["parameters"]}
    joint = flown.flight.robot.joint_names[0]
    position = limits[f"joint_positions_{joint}"]
    ends = flown.flight.robot.limits[0]
    assert position["limits"]["red"] == {"low": ends.lower, "high": ends.upper}
    assert position["limits"]["amber"]["high"] < ends.upper
    assert position["unit"] == "rad"
    assert catalogue["events"] == [(0.01, "drive scale"), (0.03, "capture")]


@given(st.integers(0, 2**32 * 10**9 - 1))
def test_times_are_rounded_down_to_a_count(stamp_ns: int) -> None:
    octets = cuc_time(stamp_ns)
    assert octets[0] == 0x2F
    counts = int.from_bytes(octets[1:], "big")
    assert 0 <= stamp_ns * 2**24 - counts * 10**9 < 10**9


@pytest.mark.parametrize(
    ("structure", "why"),
    [
        ({"rate_hz": 3000.0, "signals": ["quaternion"]}, "3000 Hz is no fraction of the 2000 Hz"),
        ({"rate_hz": 7.0, "signals": ["quaternion"]}, "7 Hz is no fraction"),
        ({"rate_hz": 10.0, "signals": ["quaternion", "quaternion"]}, "'quaternion' is there twice"),
        ({"rate_hz": 10.0, "signals": ["wheel_torques"]}, "the robot has none of these signals"),
        ({"rate_hz": 10.0, "signals": ["attitude"]}, "unknown signal 'attitude'"),
        ({"rate_hz": 10.0, "signals": ["orbit_position"]}, "unknown signal 'orbit_position'"),
        ({"rate_hz": 10.0, "signals": [{"signal": "s", "scale": 0.0}]}, "scale"),
    ],
)
def test_wrong_structures_are_refused(structure: dict[str, Any], why: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(json.dumps({"apid": 1, "structures": {"x": structure}}))
    with pytest.raises(InputError, match=f"mine.yaml.*{why}"):
        Structures(TelemetrySettings.from_yaml(file), NAMES, Timebase(500_000), str(file))


def test_all_signals_fit_one_structure(tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    every = {"rate_hz": 100.0, "signals": list(TELEMETERED)}
    twice = {"rate_hz": 10.0, "signals": ["quaternion"]}
    file.write_text(json.dumps({"apid": 1, "structures": {"all": every, "twice": twice}}))
    packets = tmp_path / "a.packets"
    options = {"telemetry": str(packets), "telemetry_packets": str(file)}
    log = Scenario(duration=0.1, **options).fly().log
    first, *_, last = [p for p in packets_in(packets) if p["pus_service"] == 3]
    assert {"s_joint1", "n_hat_base_x", "u_base_y", "e_joint6"} <= first.keys()
    assert np.isclose(last["e_joint6"], log.telemetry[last["tick"], 3, -1], rtol=0.0, atol=0.0)  # type: ignore[index]
    assert {"twice_quaternion_w"} <= {k for p in packets_in(packets) for k in p}


def test_one_name_for_packets_and_database_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a.xml: that is the name of the packets' database"):
        Scenario(duration=0.1, telemetry=str(tmp_path / "a.xml")).fly()
    assert not [*tmp_path.iterdir()]


def test_a_bag_without_a_signal_is_refused(tmp_path: Path, space_robot: Any) -> None:
    bag, file = tmp_path / "bag", tmp_path / "laws.yaml"
    Scenario(duration=0.05).fly(bag=bag)
    structure = {"rate_hz": 10.0, "signals": ["n_hat"]}
    file.write_text(json.dumps({"apid": 1, "structures": {"x": structure}}))
    ran = space_robot("telemetry", bag, "--packets", file, "-o", tmp_path / "no.packets")
    assert ran.code == 2
    assert "signal 'n_hat' is not in this log" in ran.err
    assert not (tmp_path / "no.packets").exists()
