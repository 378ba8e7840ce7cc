"""What the laws achieve in flight: errors, torques, late commands, wrong reports, lost messages."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import messages_of
from closed_loop import PERIOD, Loop, law_of
from flights import planned, simulated
from hypothesis import given, settings
from hypothesis import strategies as st
from matrix.scenarios import difference

from space_robot import Robot, Scenario
from space_robot.analysis import analyze
from space_robot.analysis.errors import tracking_error
from space_robot.analysis.words import with_statistic
from space_robot.flight.simulate import simulate
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import FlightError
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.faults.messages import MESSAGE_KINDS


@pytest.mark.parametrize(("latency", "bound"), [(1, 1e-6), (4, 5e-6)])
def test_super_twisting_flies_with_late_commands_too(
    paper_robot: Robot, latency: int, bound: float
) -> None:
    """The estimate is fed with the torque that the plant reports as applied; its age costs little,
    by joints breaking away from rest."""
    errors, _ = Loop(paper_robot, law_of("tde_stc"), command_latency_ticks=latency).fly(4000)
    assert np.abs(errors).max() < bound


def test_swapping_in_a_used_law_resets_it(paper_robot: Robot) -> None:
    law = law_of("tde_tsmc")
    loop = Loop(paper_robot, law)
    loop.fly(50)
    assert law.memory.s.any()
    loop.controller.law = law
    np.testing.assert_array_equal(law.memory.s, np.zeros(9))


def test_computed_torque_brings_the_base_back_from_a_large_turn(paper_robot: Robot) -> None:
    """120 degrees about a diagonal: e decays as (1 + 100 t) exp(-100 t), as K_P, K_D say."""
    start = [0.5, -0.5, 0.5, 0.5]
    loop = Loop(
        paper_robot,
        law_of("ctc"),
        friction=FrictionSettings(coulomb=0.0, viscous=0.0),
        initial_quaternion=start,
    )
    errors, _ = loop.fly(400)
    time = np.arange(400)[:, np.newaxis] * PERIOD
    expected = errors[0, :3] * (1.0 + 100.0 * time) * np.exp(-100.0 * time)
    np.testing.assert_allclose(errors[:, :3], expected, atol=0.02)  # zero-order hold: 5 %
    np.testing.assert_allclose(errors[-1], np.zeros(9), atol=1e-5)


def mission(duration: float | None = None, **plant: Any) -> FlightLog:
    """Case 1, by default to its end."""
    return simulated(duration=duration, parameters={"plant": plant})


def estimate_errors(log: FlightLog) -> Array:
    """Mean-axis RMS of attitude (vector part), joints 1-3 and 4-6."""
    rms = np.sqrt(np.mean(tracking_error(log) ** 2, axis=0))
    return rms.reshape(3, 3).mean(axis=1)


def variation_of_joint_6(log: FlightLog) -> float:
    """Total variation of its torque from 15 to 15.055 s, where it turns round, N m."""
    return float(np.abs(np.diff(log.applied_torque[30_000:30_111, 8])).sum())


def test_the_mission_of_the_paper_has_its_figures() -> None:
    """TDE-STC, case 1, Table IV; joints 4 to 6 as with a plant of 256 steps a tick."""
    log = mission()
    rms = with_statistic(analyze(log)["metrics"], "rms")
    assert log.ticks == 60_000
    assert max(rms["attitude"], rms["joints_1_3"], rms["joints_4_6"]) < 1e-7
    wanted = {"base_torque": 0.7996, "torque_1_3": 0.9304, "torque_4_6": 0.0526}
    assert {name: rms[name] for name in wanted} == pytest.approx(wanted, rel=0.005)
    assert estimate_errors(log)[2] == pytest.approx(1.14e-8, rel=0.05)
    assert 0.005 / 3.0 < variation_of_joint_6(log) < 0.015


def test_the_sign_inside_the_step_chatters() -> None:
    log = mission(**{"friction.set_valued": False})
    assert estimate_errors(log)[2] == pytest.approx(3.46e-8, rel=0.01)
    assert variation_of_joint_6(log) == pytest.approx(1.601, rel=0.01)


FATAL = math.inf
LARGE = [500.0] * 3 + [20.0] * 3 + [0.5] * 3


@pytest.mark.parametrize(
    ("law", "plant", "options", "ticks", "most"),
    [
        # one per cent too much in the echo is fatal: rounding grows, and what friction kicks off
        ("tde_stc", {"echo_scale": [1.01]}, {}, 31654, FATAL),
        ("tde_tsmc", {"echo_scale": [1.01]}, {"gains": "tuned"}, 20387, FATAL),
        ("tde_stc", {}, {"faults": [f"torque_scale@0:all={1 / 1.01}"]}, 31654, FATAL),
        # two are flown with a larger inertia
        (
            "tde_stc",
            {},
            {"faults": ["torque_scale@0:all=0.98"], "gains": {"h_bar": LARGE}},
            60_000,
            1e-6,
        ),
        # in the drives it is a disturbance, unless a sensor reports what is given
        ("tde_stc", {"drive_scale": [1.01]}, {}, 60_000, 1e-7),
        ("tde_stc", {"drive_scale": [1.01], "torque_echo": "given"}, {}, 31654, FATAL),
    ],
)
def test_a_wrong_torque_is_fatal_in_the_echo_and_not_in_the_drive(
    law: str, plant: dict[str, Any], options: dict[str, Any], ticks: int, most: float
) -> None:
    """Ticks of divergence were found on code written apart from this, with a bare sign()."""
    flight = Scenario(controller=law, parameters={"plant": plant}, **options).check()
    rough = 0.25 if "torque_echo" in plant else 0.05
    try:
        attitude = tracking_error(simulate(flight))[:, :3]
    except FlightError:
        assert most == FATAL
        assert flight.plant.tick == pytest.approx(ticks, rel=rough)
        return
    assert flight.plant.tick == ticks
    assert float(np.sqrt(np.mean(attitude**2))) < most


def attitude_rms(law: str, gains: dict[str, Any], scale: float) -> float:
    """Of a flight of case 1 whose torque is reported with a factor."""
    parameters = {"plant": {"echo_scale": [scale]}}
    log = simulate(Scenario(controller=law, gains=gains, parameters=parameters).check())
    return float(estimate_errors(log)[0])


def test_estimates_with_the_nominal_inertia_bear_a_wrong_torque_report() -> None:
    """To two digits as measured on code written apart from this; too small costs as much as too
    large."""
    for scale, error in ((1.01, 3.2e-8), (1.2, 6.4e-7), (0.8, 6.4e-7)):
        found = attitude_rms("indi", {"k_p": 25.0, "k_d": 10.0}, scale)
        assert found == pytest.approx(error, rel=0.02)
    assert attitude_rms("tde_stc", {"h_bar": "nominal"}, 1.2) < 1.6e-7


def still(law: str, **options: Any) -> float:
    """Largest angle of the base, rad, of a flight without friction."""
    log = simulated(controller=law, friction=False, **{"duration": 10.0, **options})
    return float(2.0 * np.abs(log.quaternion[:, 1:]).max())


def test_feedforward_with_a_perfect_model_holds_the_base() -> None:
    """To rounding as long as the joints begin to move; then what is left is that the torque is held
    over a tick: proportional to the period, and far below what PD control alone leaves."""
    assert still("pd_feedforward", duration=0.5) < 1e-12
    errors = [still("pd_feedforward", period=period) for period in (1e-3, 5e-4)]
    assert errors[1] < min(1e-10, 1e-4 * still("pd"))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.01)


# Flights in one process whose messages fail

NOTHING = "drop_state@0:0"
"""A fault of messages that never happens."""
TICKS = 200


def flown(*faults: str, bag: Path | None = None, **options: Any) -> FlightLog:
    return simulated(bag, faults=list(faults), **{"duration": TICKS * 5e-4, **options})


def test_lost_commands_hold_the_torque_and_then_there_is_none() -> None:
    log = flown("drop_command@0.02-0.07", parameters={"plant": {"hold_ticks": 50}})
    held, gone = log.applied_torque[41:90], log.applied_torque[91:141]
    np.testing.assert_array_equal(held, np.tile(held[0], (49, 1)))
    assert np.abs(held).max() > 0.0
    assert not gone.any()
    assert np.abs(log.applied_torque[141:]).max() > 0.0


def test_lost_states_have_no_command_and_are_filled() -> None:
    log = flown("drop_state@0.02-0.03")
    assert log.commanded_torque is not None
    assert np.flatnonzero(np.isnan(log.commanded_torque[:, 0])).tolist() == list(range(40, 60))
    assert (log.filled, log.unanswered, log.damage) == (20, 20, ())


ARGUMENTS = {"P": ["0.02", "0.3", "1"], "TICKS": ["0", "1", "4"]}


@st.composite
def message_faults(draw: st.DrawFn) -> str:
    """One of any kind, in the first 0.09 s."""
    kind = draw(st.sampled_from(list(MESSAGE_KINDS.values())))
    start, stop = sorted(draw(st.lists(st.integers(0, 90), min_size=2, max_size=2, unique=True)))
    assert kind.argument
    argument = draw(st.sampled_from(ARGUMENTS[kind.argument.symbol]))
    return f"{kind.name}@{start / 1000}-{stop / 1000}:{argument}"


@settings(max_examples=8, deadline=None)
@given(st.lists(message_faults(), min_size=1, max_size=5), st.integers(0, 1000))
def test_whatever_fails_the_rules_hold(faults: list[str], seed: int) -> None:
    """The flight repeats, and no torque is wild, neither asked for nor applied."""
    log = flown(*faults, seed=seed)
    assert difference(log, flown(*faults, seed=seed)) == ""
    usual = np.abs(flown().applied_torque).max()
    for torque in (log.applied_torque, log.commanded_torque):
        assert torque is not None
        assert not np.any(np.abs(torque) > 100.0 * usual)


def test_the_bag_has_every_message_once_and_in_order(tmp_path: Path) -> None:
    flown("repeat_state@0:0.5", "jitter_state@0:2", "repeat_command@0", bag=tmp_path / "bag")
    found: dict[str, list[bytes]] = {}
    for topic, message in messages_of(tmp_path / "bag"):
        found.setdefault(topic.full_name, []).append(message)
    for topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
        assert len(set(found[topic.full_name])) == len(found[topic.full_name])
    assert len(found[topics.JOINT_STATES.full_name]) in range(TICKS - 2, TICKS + 1)
    assert len(found[topics.COMMAND.full_name]) < TICKS, "overtaken states are not answered"


def test_what_was_flown_here_is_trusted_and_its_progress_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("space_robot.flight.simulate.MESSAGE_STRETCH", 75)
    for bag in (None, tmp_path / "bag"):
        ticks: list[int] = []
        flight = planned(faults=[NOTHING], duration=TICKS * 5e-4)
        assert simulate(flight, bag, ticks.append).trusted
        assert ticks == [0, 75, 150, TICKS]
    assert flown().trusted
