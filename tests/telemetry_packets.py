"""Telemetry packets as others read them: LASP's parser, by the XTCE database alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from space_robot_msgs_py.bag.flight_log import FlightLog

generators = pytest.importorskip("space_packet_parser.generators.ccsds")
xtce = pytest.importorskip("space_packet_parser.xtce.definitions")

HEADERS = ("ccsds_", "pus_", "time", "structure", "tick", "law", "checksum")


def packets_of(file: Path) -> list[bytes]:
    """The packets in a file."""
    with file.open("rb") as stream:
        return [bytes(packet) for packet in generators.ccsds_generator(stream)]


def packets_in(file: Path) -> list[dict[str, Any]]:
    """Each packet of a file as its database says, read by others' code."""
    definition = xtce.XtcePacketDefinition.from_xtce(
        file.with_suffix(".xml"), root_container_name="telemetry_packet"
    )
    return [dict(definition.parse_bytes(packet)) for packet in packets_of(file)]


def expected(log: FlightLog, tick: int) -> dict[str, float]:
    """Every number that telemetry may have of a tick, by the rule of its names."""
    log, values = log.as_measured(), {}
    wheels = [f"wheel_{k + 1}" for k in range(log.wheel_velocities.shape[1])]
    axes = ["base_x", "base_y", "base_z", *log.joint_names]
    joints, base = log.reference_joints[tick], log.reference_base[tick]
    columns = [
        ("quaternion", "wxyz", log.quaternion[tick]),
        ("omega_base", "xyz", log.omega_base[tick]),
        ("joint_positions", log.joint_names, log.joint_positions[tick]),
        ("joint_velocities", log.joint_names, log.joint_velocities[tick]),
        ("passive_positions", log.passive_names, log.passive_positions[tick]),
        ("applied_torque", axes, log.applied_torque[tick]),
        ("commanded_torque", axes, log.commanded_torque[tick]),  # type: ignore[index]
        ("wheel_velocities", wheels, log.wheel_velocities[tick]),
        ("wheel_torques", wheels, log.wheel_torques[tick]),
        ("actuator_commands", wheels, log.actuator_commands[tick]),
        ("reference_quaternion", "wxyz", base[:4]),
        ("reference_omega_base", "xyz", base[4:7]),
        ("reference_joint_positions", log.joint_names, joints[0]),
    ]
    for signal, labels, numbers in columns:
        values |= {f"{signal}_{n}": float(v) for n, v in zip(labels, numbers, strict=True)}
    return values


def check_equal(file: Path, log: FlightLog) -> int:
    """Compare every number of every housekeeping packet with the log; return how many."""
    count = 0
    for packet in packets_in(file):
        if packet["pus_service"] != 3:
            continue
        values = expected(log, packet["tick"])
        assert abs(packet["time"] - packet["tick"] * log.timebase.period) < 1e-7
        for name, value in packet.items():
            if not name.startswith(HEADERS):
                assert value == values[name], name
                count += 1
    return count
