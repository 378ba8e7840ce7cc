"""When faults act, what they do to the plant itself, and all of them together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import assert_same

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import STATE_FIELDS, Command, RobotNames
from space_robot_sim.faults.grammar import parse_fault, parse_faults
from space_robot_sim.faults.link import awaited_stamp
from space_robot_sim.faults.schedule import Schedule, ScheduledFault
from space_robot_sim.plant.faults import PLANT_KINDS, MessageFaults
from space_robot_sim.plant.plant import Plant, PlantSettings
from space_robot_sim.plant.settings import PlantNodeSettings

PERIOD = 5e-4
TORQUE = np.array([5.0, -4.0, 3.0, 20.0, -30.0, 15.0, 4.0, -3.0, 2.0])


def scheduled(text: str, period: float = PERIOD, seed: int = 0) -> ScheduledFault:
    return ScheduledFault(parse_fault(text, PLANT_KINDS), 0, seed, period)


def plant_of(robot: Robot, *faults: str, seed: int = 0, **settings: float) -> Plant:
    start = {"initial_joints_deg": [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]}
    given = {**start, "faults": list(faults), "fault_seed": seed, **settings}
    return Plant(robot, PlantSettings.model_validate(given), PERIOD)


def message_faults(robot: Robot, *texts: str, seed: int = 0) -> MessageFaults:
    settings = PlantSettings(faults=list(texts), fault_seed=seed)
    return MessageFaults(settings.schedule(RobotNames(robot.joint_names), PERIOD), robot.n)


@given(st.integers(0, 10**7), st.integers(1, 10**5), st.sampled_from([1e-4, 5e-4, 1e-3, 0.01]))
def test_a_fault_acts_from_its_tick_to_its_end(first: int, length: int, period: float) -> None:
    """Times that are whole ticks up to rounding are those ticks; in between, the next."""
    fault = scheduled(f"nan_state@{first * period!r}-{(first + length) * period!r}", period)
    assert (fault.first, fault.stop) == (first, first + length)
    later = scheduled(f"nan_state@{(first + 0.5) * period!r}", period)
    assert (later.first, later.stop) == (first + 1, math.inf)
    acting = [fault.acts_at(first + k) for k in (-1, 0, length - 1, length)]
    assert acting == [False, True, True, False]


def test_a_time_without_a_tick_is_an_error() -> None:
    with pytest.raises(InputError, match=r"'nan_state@0.0001-0.0002': .* no tick of 0.0005 s"):
        scheduled("nan_state@0.0001-0.0002")


@given(st.integers(0, 2**31 - 1), st.integers(0, 5000))
def test_draws_depend_on_seed_place_and_tick_alone(seed: int, tick: int) -> None:
    """Not on when the fault began, what was asked before, whether it happens, nor neighbours."""
    early, late = scheduled("drop_state@0:0.5", seed=seed), scheduled("drop_state@0.01", seed=seed)
    early.choose(3, 10)
    assert early.choose(tick, 1000) == late.choose(tick, 1000)
    happened = [t for t in range(400) if early.happens_at(t)]
    chosen = [early.choose(t, 1000) for t in happened]
    assert len(happened) == pytest.approx(200, abs=50)
    assert np.mean(chosen) == pytest.approx(499.5, abs=5.0 * 289.0 / len(chosen) ** 0.5)
    texts = ["drop_state@0:1", "drop_state@0:1"]
    one, two = Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD).faults
    assert one.choose(tick, 10**9) != two.choose(tick, 10**9)


def memory_of(plant: Plant) -> tuple[list[float], list[float]]:
    memory = plant.block[0]
    limit, friction = memory.actuators.torque_limit.limit, memory.environment.friction
    return limit.tolist(), friction.coulomb.tolist()


def test_actuators_fail_in_time_and_are_restored_exactly(paper_robot: Robot) -> None:
    """Overlapping faults too: the lower limit and the higher friction count."""
    texts = [
        "saturate_base@0.005-0.01:2",
        "saturate_base@0.0075-0.015:1",
        "saturate_joints@0.01:3",
        "stuck_joint@0.005-0.01:2=20",
        "stuck_joint@0.005-0.0075:6=0.001",
    ]
    plant = plant_of(paper_robot, *texts, joint_torque_limit=7.0)
    sound, coulomb = memory_of(plant)
    assert sound == [math.inf] * 3 + [7.0] * 6
    for tick in range(40):
        base = min(2.0 if 10 <= tick < 20 else math.inf, 1.0 if 15 <= tick < 30 else math.inf)
        joints = 3.0 if tick >= 20 else 7.0
        stuck = [coulomb[0], 20.0 if 10 <= tick < 20 else coulomb[1], *coulomb[2:]]
        assert memory_of(plant) == ([base] * 3 + [joints] * 6, stuck)
        plant.step(Command(tick, TORQUE))
        assert np.abs(plant.state.applied_torque[:3]).max() <= base
        assert np.abs(plant.state.applied_torque[3:]).max() <= joints


def test_a_fault_never_makes_an_actuator_stronger_nor_a_joint_freer(paper_robot: Robot) -> None:
    """Limits and friction that are worse than the fault's stay; 0 is the lowest limit of all."""
    texts = ["saturate_base@0.0005:2", "saturate_joints@0.0005:9", "stuck_joint@0.0005:2=1"]
    plant = plant_of(paper_robot, *texts, base_torque_limit=0.5, joint_torque_limit=7.0)
    plant.block[0].actuators.torque_limit.limit[4] = 0.0
    plant.block[0].environment.friction.coulomb[1] = 3.0
    worst = memory_of(plant)
    for tick in range(3):
        plant.step(Command(tick, TORQUE))
        assert memory_of(plant) == worst


def test_after_the_last_fault_the_plant_is_as_it_was(paper_robot: Robot) -> None:
    texts = ["saturate_base@0-0.005:0", "saturate_joints@0-0.005:1", "stuck_joint@0-0.005:1=9"]
    plant, sound = plant_of(paper_robot, *texts), memory_of(plant_of(paper_robot))
    for tick in range(11):
        assert (memory_of(plant) == sound) is (tick >= 10)
        plant.step(Command(tick, TORQUE))
    assert memory_of(plant) == sound


@pytest.mark.parametrize("joint", range(1, 7))
def test_a_stuck_joint_stops_and_comes_free_again(paper_robot: Robot, joint: int) -> None:
    """Thrown first, then held while its motor and the other joints pull at it."""
    friction = 15.0 if joint <= 3 else 3.0  # four times what its motor gives
    plant = plant_of(paper_robot, f"stuck_joint@0.25-1:{joint}={friction}")
    angles, rates = np.empty((2500, 6)), np.empty((2500, 6))
    for tick in range(2500):
        plant.step(Command(tick, np.where(np.arange(9) < 3, 0.0, 0.2 * TORQUE)))
        angles[tick], rates[tick] = plant.state.joint_positions, plant.state.joint_velocities
    before, held, after = slice(500), slice(1000, 1500), slice(2000, 2500)
    swing = [float(np.ptp(angles[part, joint - 1])) for part in (before, held, after)]
    assert min(swing[0], swing[2]) > 1e-3
    assert swing[1] == 0.0
    assert not rates[held, joint - 1].any()
    assert np.ptp(angles[held], axis=0).max() > 1e-3, "the others move on"


def flight(robot: Robot, *texts: str, seed: int = 0, ticks: int = 400) -> list[list[float]]:
    """Applied torques under a spring on what was measured, over both links."""
    plant = plant_of(robot, *texts, seed=seed)
    faults = message_faults(robot, *texts, seed=seed)
    held, log, answered = Command(-1, np.zeros(9)), [], -1
    for tick in range(ticks):
        measured = faults.measure(plant.state)
        pull = np.concatenate([-5.0 * measured.omega_base, -measured.joint_velocities + 0.1])
        states = faults.states.push(tick, pull, measured.tick)
        awaited = awaited_stamp(states, tick, answered)
        if awaited is not None:
            (pull,) = [state.item for state in states if state.stamp == awaited][-1:]
            command, answered = Command(awaited, pull), awaited
            faults.corruption.corrupt_command(command, tick)
            faults.commands.send(tick, command, awaited)
        for parcel in faults.commands.arrivals(tick):
            if parcel.stamp > held.tick and np.isfinite(parcel.item.torque).all():
                held = parcel.item
        plant.step(held)
        log.append(plant.state.applied_torque.tolist())
    return log


MANY = (
    "drop_state@0:0.2",
    "repeat_state@0.01:0.2",
    "delay_state@0.02-0.1:2",
    "jitter_state@0.05:3",
    "drop_command@0:0.2",
    "jitter_command@0.1:2",
    "noise_gyro@0:1e-3",
    "noise_attitude@0:1e-3",
    "quantise_joint_velocity@0.1:1e-4",
    "stamp_back@0:0.1",
    "stamp_jump@0:0.1",
    "nan_command@0:0.1",
    "saturate_joints@0.1-0.15:0.05",
    "stuck_joint@0.1:2=5",
)


def test_a_flight_with_many_faults_repeats_exactly(paper_robot: Robot) -> None:
    one = flight(paper_robot, *MANY, seed=3)
    assert np.isfinite(one).all()
    assert flight(paper_robot, *MANY, seed=3) == one
    assert flight(paper_robot, *MANY, seed=4) != one


def test_faults_that_do_nothing_change_nothing(paper_robot: Robot) -> None:
    """Nor does a fault before its time."""
    still = [
        text.format(0)
        for text in (
            "drop_state@0:{}",
            "jitter_command@0:{}",
            "noise_gyro@0:{}",
            "stamp_jump@0:{}",
            "nan_command@0:{}",
            "stuck_joint@0:2={}",
        )
    ]
    plain = flight(paper_robot)
    assert flight(paper_robot, *still, "nan_state@1", "saturate_joints@1:0") == plain


def test_measurements_carry_the_wrong_stamp_and_the_truth_its_own(paper_robot: Robot) -> None:
    plant = plant_of(paper_robot)
    faults = message_faults(paper_robot, "stamp_jump@0", "nan_state@0")
    measured = faults.measure(plant.state)
    assert measured.tick == 1_000_000
    assert plant.tick == 0
    assert all(np.isfinite(getattr(plant.state, name)).all() for name in STATE_FIELDS)
    assert not all(np.isfinite(getattr(measured, name)).all() for name in STATE_FIELDS)


def test_faults_must_fit_the_plant(paper_robot: Robot) -> None:
    for joint in ("7", "base_x", "elbow", "all"):
        allowed = "choose one of joint1, .*, joint6, 1 to 6, joints"
        wrong = f"^fault 'stuck_joint@1:{joint}=2': no joint '{joint}': {allowed}$"
        with pytest.raises(InputError, match=wrong):
            plant_of(paper_robot, f"stuck_joint@1:{joint}=2")


def test_a_plant_changes_when_its_parts_begin_or_cease_to_fail(paper_robot: Robot) -> None:
    """Compiled code may fly on over all ticks between; messages are not the plant's affair."""
    texts = ("stuck_joint@0.01-0.02:1=9", "saturate_base@0.02:1", "drop_state@0.005")
    plant, changes = plant_of(paper_robot, *texts), set()
    for tick in range(50):
        changes.add(plant.next_change)
        plant.step(Command(tick, 0.0 * TORQUE))
    assert changes == {20, 40, math.inf}


def test_truth_and_measurement_are_told_apart(paper_robot: Robot) -> None:
    """Equal with sound sensors; a plant with noise flies the same truth."""
    sound, noisy = plant_of(paper_robot), plant_of(paper_robot, "noise_gyro@0.005:1")
    assert sound.measures_truth
    assert not noisy.measures_truth
    for tick in range(20):
        assert_same(sound.state, sound.truth)
        assert_same(noisy.truth, sound.truth)
        off = np.abs(noisy.state.omega_base - noisy.truth.omega_base)
        assert (off > 0.0).all() if tick >= 10 else (off == 0.0).all()
        assert sound.state.tick == sound.truth.tick == noisy.truth.tick == tick
        for plant in (sound, noisy):
            plant.step(Command(tick, TORQUE))


def test_settings_take_faults_and_refuse_bad_ones() -> None:
    assert PlantNodeSettings.resolve({}).parsed_faults == []
    settings = PlantNodeSettings.resolve({"faults": ["", "drop_state@2:0.1"], "fault_seed": 7})
    assert [str(fault) for fault in settings.parsed_faults] == ["drop_state@2:0.1"]
    assert settings.fault_seed == 7
    with pytest.raises(InputError, match="plant parameters: faults: fault 'drop@2': unknown kind"):
        PlantNodeSettings.resolve({"faults": ["drop@2"]})
    with pytest.raises(InputError, match="fault 'kill_mission@2': unknown kind"):
        PlantNodeSettings.resolve({"faults": ["kill_mission@2"]})
    with pytest.raises(InputError, match=r"fault_seed: .* greater than or equal to 0"):
        PlantNodeSettings.resolve({"fault_seed": -1})
