"""Laws and controllers that take over in flight: no jolt, and the tracking stays."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.analysis.metrics import tracking_error
from space_robot.flight.closed_loop import close_loop
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import build_law
from space_robot_control.laws import ControlLaw, laws
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

TAKEOVER, STOP = 10_000, 12_000
"""Ticks: at 5 s the arm is in full motion; flown until 6 s."""
NEXT_10_MS = 20
LAWS = sorted(laws())
ACCURATE = [name for name in LAWS if name.startswith(("ctc", "tde", "indi"))]
"""Laws that know or estimate every force, and so have small errors in full motion."""
ROUNDING = 1e-9
"""N m; the base turns a little from tick to tick, and J0 with it."""


class CommonBeginning:
    """A flight up to `TAKEOVER` under one law, to be flown on under others."""

    def __init__(self, law: str, **plan: object) -> None:
        self.flight = Flight(
            resolve(
                FlightPlan.model_validate(
                    {"controller": law, "gains": "tuned", "duration": 6, **plan}
                )
            )
        )
        self.log = empty_log(self.flight)
        self._fly(self.flight.controller, 0, TAKEOVER)
        plant = self.flight.plant
        self._memories = [plant.block, plant.command_delay_buffer, self.flight.controller.block]
        self._kept = [memory.copy() for memory in self._memories]

    def swapped_to(self, law: str) -> FlightLog:
        """The flight under another law from `TAKEOVER` on."""
        self._go_back()
        self.flight.controller.law = self._law(law)
        return self._fly(self.flight.controller, TAKEOVER, STOP)

    def taken_over_by(self, law: str) -> FlightLog:
        """The flight with another controller, as after a restart, from `TAKEOVER` on."""
        self._go_back()
        new = Controller(
            self.flight.robot,
            self._law(law),
            self.flight.period,
            actuators=self.flight.scenario.assumed_actuators,
        )
        return self._fly(new, TAKEOVER, STOP)

    def _go_back(self) -> None:
        for memory, kept in zip(self._memories, self._kept, strict=True):
            memory[...] = kept
        self.flight.plant.state.tick = TAKEOVER

    def _law(self, name: str) -> ControlLaw:
        return build_law(name, self.flight.controller_settings, self.flight.robot.n + 3)

    def _fly(self, controller: Controller, start: int, stop: int) -> FlightLog:
        close_loop(self.flight.plant, controller, self.log, start, stop)
        return self.log


def assert_smooth(log: FlightLog, *in_force: str) -> None:
    """The torque steps no more than in the 10 ms after, on any axis, and the base stays."""
    steps = np.abs(np.diff(log.commanded_torque, axis=0))
    own = steps[TAKEOVER : TAKEOVER + NEXT_10_MS].max(axis=0)
    assert (steps[TAKEOVER - 1] <= own).all()
    assert_accurate(log, *in_force)


def assert_accurate(log: FlightLog, *in_force: str) -> None:
    """The errors stay small, if they are under the laws in force."""
    if set(in_force) <= set(ACCURATE):
        error = np.abs(tracking_error(log)[TAKEOVER:STOP])
        assert error[:, :3].max() < 1e-5
        assert error[:, 3:].max() < 1e-4


@pytest.mark.parametrize("first", LAWS)
def test_every_law_takes_over_smoothly_from_every_other(first: str) -> None:
    """In full motion."""
    beginning = CommonBeginning(first)
    for law in LAWS:
        if law != first:
            assert_smooth(beginning.swapped_to(law), first, law)


@pytest.mark.parametrize("first", LAWS)
def test_a_new_controller_takes_over_smoothly_in_flight(first: str) -> None:
    """As after a restart, under the same law or another."""
    beginning = CommonBeginning(first)
    for law in LAWS:
        assert_smooth(beginning.taken_over_by(law), first, law)


@pytest.mark.parametrize("latency", [1, 2, 4])
def test_with_late_commands_a_law_takes_over_from_what_is_applied_now(latency: int) -> None:
    """Which is the command of ``latency`` ticks ago: the torque goes back by what it has gone
    since, and no further."""
    beginning = CommonBeginning("tde_stc", command_latency_ticks=latency)
    for law in LAWS:
        for log in (beginning.swapped_to(law), beginning.taken_over_by(law)):
            torque = log.commanded_torque
            applied = torque[TAKEOVER - 1 - latency]
            np.testing.assert_allclose(torque[TAKEOVER], applied, atol=ROUNDING)
            assert_accurate(log, law)


@pytest.mark.parametrize("law", LAWS)
def test_a_new_controller_finds_the_force_at_any_attitude(law: str) -> None:
    """It was not there at the tick before, so it takes J0 from its first state."""
    plant = {"initial_quaternion": [0.8, 0.0, 0.6, 0.0]}
    log = CommonBeginning("tde_stc", parameters={"plant": plant}).taken_over_by(law)
    assert abs(log.quaternion[TAKEOVER, 2]) > 0.1
    torque = log.commanded_torque
    np.testing.assert_allclose(torque[TAKEOVER], torque[TAKEOVER - 1], rtol=1e-9, atol=ROUNDING)


@pytest.mark.parametrize("first", LAWS)
def test_a_law_takes_over_smoothly_with_a_base_that_nothing_turns(first: str) -> None:
    """From another and from none; the base gets no torque, whatever was on its axes."""
    beginning = CommonBeginning(first, actuators="none")
    for law in LAWS:
        for log in (beginning.swapped_to(law), beginning.taken_over_by(law)):
            torque = log.commanded_torque
            steps = np.abs(np.diff(torque, axis=0))
            own = steps[TAKEOVER : TAKEOVER + NEXT_10_MS].max(axis=0)
            assert (steps[TAKEOVER - 1] <= own).all()
            assert (torque[TAKEOVER:STOP, :3] == 0.0).all()
            if {first, law} <= set(ACCURATE):
                assert np.abs(tracking_error(log)[TAKEOVER:STOP, 3:]).max() < 1e-4
