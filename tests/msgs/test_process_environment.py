"""What a process of this project finds in its environment, and how far it can be heard."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.ros.process_environment import (
    ANY_RANGE,
    PROFILES,
    RANGE,
    THIS_MACHINE,
    completed,
)

LOCAL = {RANGE: "SYSTEM_DEFAULT", PROFILES: THIS_MACHINE}

environments = st.fixed_dictionaries(
    {},
    optional={
        RANGE: st.sampled_from(["LOCALHOST", "SUBNET", "OFF", "SYSTEM_DEFAULT"]),
        PROFILES: st.sampled_from([ANY_RANGE, THIS_MACHINE, "mine.xml"]),
        "ROS_STATIC_PEERS": st.sampled_from(["", "192.0.2.1"]),
        "ROS_LOCALHOST_ONLY": st.sampled_from(["", "0", "1"]),
        "RMW_IMPLEMENTATION": st.sampled_from(["rmw_fastrtps_cpp", "rmw_cyclonedds_cpp"]),
    },
)


@given(environments)
def test_a_completed_environment_stays_as_it_is(environment: dict[str, str]) -> None:
    once = completed(environment)
    assert completed(once) == once


@given(environments)
def test_the_network_is_open_only_to_those_who_asked(environment: dict[str, str]) -> None:
    result = completed(environment)
    asked = environment.get(RANGE, "LOCALHOST") != "LOCALHOST"
    local = result[RANGE] in ("LOCALHOST", "OFF") or LOCAL.items() <= result.items()
    assert local or asked


@pytest.mark.parametrize("given_", [{}, {RANGE: "LOCALHOST"}, {"ROS_LOCALHOST_ONLY": "1"}])
def test_this_machine_is_the_default(given_: dict[str, str]) -> None:
    expected = {**LOCAL, **({"ROS_LOCALHOST_ONLY": "0"} if "ROS_LOCALHOST_ONLY" in given_ else {})}
    assert completed(given_) == expected


def test_the_users_range_peers_and_profile_hold() -> None:
    assert completed({RANGE: "SUBNET"}) == {RANGE: "SUBNET", PROFILES: ANY_RANGE}
    assert completed({**LOCAL, RANGE: "SUBNET"}) == {RANGE: "SUBNET", PROFILES: ANY_RANGE}
    peers = {"ROS_STATIC_PEERS": "192.0.2.1"}
    assert completed(peers) == {RANGE: "LOCALHOST", PROFILES: ANY_RANGE, **peers}
    assert completed({PROFILES: "mine.xml"}) == {RANGE: "LOCALHOST", PROFILES: "mine.xml"}
