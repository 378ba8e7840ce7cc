"""Swaps as text; laws and controllers that take over in flight without a jolt."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.analysis.errors import tracking_error
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import close_loop
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import build_law
from space_robot_control.controller.law_choice import Swap, parse_swaps
from space_robot_control.laws import laws
from space_robot_msgs_py.bag.flight_log import FlightLog

PERIOD = 5e-4


@given(st.dictionaries(st.integers(0, 10**8), st.sampled_from(["ctc", "tde_stc"])), st.randoms())
def test_swaps_are_read_in_the_order_of_their_ticks(laws: dict[int, str], shuffler: object) -> None:
    """Each on the very tick that its time is the beginning of."""
    texts = [f"{tick * PERIOD!r}:{name}" for tick, name in laws.items()]
    shuffler.shuffle(texts)  # type: ignore[attr-defined]
    assert parse_swaps(texts, PERIOD) == [Swap(tick, laws[tick]) for tick in sorted(laws)]


@pytest.mark.parametrize(
    ("texts", "swaps"),
    [
        (["0.00051:ctc"], [Swap(2, "ctc")]),  # between two ticks the next one counts
        (["", "  "], []),  # ROS has no empty list of strings
        (["1: my_laws:Mine "], [Swap(2000, "my_laws:Mine")]),
    ],
)
def test_a_swap_is_read(texts: list[str], swaps: list[Swap]) -> None:
    assert parse_swaps(texts, PERIOD) == swaps


# Taking over


NOMINAL = [f"{name} nominal" for name, law in laws().items() if "h_bar" in law.gain_descriptions()]
LAWS = sorted([*laws(), *NOMINAL])
TAKEOVER, STOP = 2000, 2060
"""Ticks: at 1 s the arm moves on all its joints; flown until 1.03 s."""
ACCURATE = [name for name in LAWS if name.startswith(("ctc", "tde", "indi"))]
"""Laws that know or estimate every force, and so have small errors in motion."""


def name_of(law: str) -> str:
    """Without the inertia of its estimate."""
    return law.split()[0]


class CommonBeginning:
    """A flight up to `TAKEOVER` under one law, to be flown on under others."""

    def __init__(self, law: str, **plan: object) -> None:
        gains = {name_of(law): {"h_bar": ["nominal"]}} if law in NOMINAL else "tuned"
        content = {"controller": name_of(law), "gains": gains, "duration": 1.05, **plan}
        self.flight = Flight(resolve(Scenario.model_validate(content)))
        self.log = empty_log(self.flight)
        close_loop(self.flight.plant, self.flight.controller, self.log, 0, TAKEOVER)
        plant = self.flight.plant
        self._memories = [plant.block, plant.command_delay_buffer, self.flight.controller.block]
        self._kept = [memory.copy() for memory in self._memories]

    def goes_on(self, name: str, is_restarted: bool) -> tuple[Controller, FlightLog]:
        """The flight under another law from `TAKEOVER` on: of the same controller, or of a new
        one as after a restart; it has not been there at the tick before."""
        for memory, kept in zip(self._memories, self._kept, strict=True):
            memory[...] = kept
        flight, controller = self.flight, self.flight.controller
        flight.plant.state.tick = TAKEOVER
        law = build_law(name_of(name), flight.controller_settings, flight.robot.n + 3)
        if name in NOMINAL:
            law.gain_values = {**law.gain_values, "h_bar": np.zeros(flight.robot.n + 3)}
        if is_restarted:
            actuators = flight.scenario.assumed_actuators
            controller = Controller(flight.robot, law, flight.period, actuators=actuators)
        else:
            controller.law = law
        close_loop(flight.plant, controller, self.log, TAKEOVER, TAKEOVER + 1)
        applied, force = controller.signals.applied_force, controller.block[0].force
        np.testing.assert_allclose(force, applied, rtol=1e-9, atol=1e-9)
        close_loop(flight.plant, controller, self.log, TAKEOVER + 1, STOP)
        assert controller.block[0].transfer_left == 0.0
        return controller, self.log


def assert_smooth(log: FlightLog, before: str, now: str) -> None:
    """The torque steps no more than in the 10 ms after, on any axis, and the errors stay."""
    assert log.commanded_torque is not None
    steps = np.abs(np.diff(log.commanded_torque[:STOP], axis=0))
    own = steps[TAKEOVER : TAKEOVER + 20].max(axis=0)
    assert (steps[TAKEOVER - 1] <= own).all(), (before, now)
    if {before, now} <= set(ACCURATE):
        error = np.abs(tracking_error(log)[TAKEOVER:STOP])
        assert error[:, :3].max() < 1e-5, (before, now)
        assert error[:, 3:].max() < 1e-4, (before, now)


@pytest.mark.parametrize("is_restarted", [False, True], ids=["swapped", "restarted"])
@pytest.mark.parametrize("first", LAWS)
def test_every_law_takes_over_smoothly_from_every_other(first: str, is_restarted: bool) -> None:
    """At the first tick the force is the one applied; after 20 ms it is the law's own."""
    beginning = CommonBeginning(first)
    for law in LAWS:
        if law != first or is_restarted:
            assert_smooth(beginning.goes_on(law, is_restarted)[1], first, law)


PLANS: list[dict[str, Any]] = [
    {"command_latency_ticks": 1},
    {"command_latency_ticks": 4},
    {"parameters": {"plant": {"initial_quaternion": [0.8, 0.0, 0.6, 0.0]}}},
    {"actuators": "none"},
    {"case": "3"},
]


@pytest.mark.parametrize("plan", PLANS, ids=str)
def test_so_it_does_late_at_any_attitude_with_a_free_base_and_payload(plan: dict[str, Any]) -> None:
    """With late commands from what is applied now: the torque goes back by what it has gone since,
    and no further. A base that nothing turns gets no torque, whatever was on its axes."""
    beginning, late = CommonBeginning("tde_stc", **plan), plan.get("command_latency_ticks", 0)
    for law in LAWS:
        for is_restarted in (False, True):
            torque = beginning.goes_on(law, is_restarted)[1].commanded_torque
            assert torque is not None
            applied = torque[TAKEOVER - 1 - late]
            near = 2e-5 if "parameters" in plan else 1e-6  # J0 turns with the base
            np.testing.assert_allclose(torque[TAKEOVER], applied, rtol=near, atol=near)
            if "actuators" in plan:
                assert (torque[TAKEOVER:STOP, :3] == 0.0).all()
