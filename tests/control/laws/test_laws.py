"""Each law against a transcription of its equation, over whole histories of signals at once."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_equations import EQUATIONS, PERIOD, TICKS, History, forces, random_gains
from paths import ROOT

from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.controller.gains import check_gains, read_gains
from space_robot_control.laws import (
    CompiledLaw,
    ControlLaw,
    GainRange,
    Signals,
    find_law,
    laws,
    per_axis,
)
from space_robot_control.laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA
from space_robot_control.laws.ctc_smc import saturation
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import InputError

WITH_FRICTION = ("ctc", "ctc_smc", "pd", "pd_feedforward", "slotine_li")
OPTIONAL = {"k_i", "viscous", "coulomb", "dead_band"}


def law_of(name: str, seed: int, axes: int = 9) -> ControlLaw:
    """A law with random gains."""
    law = find_law(name)
    return law(random_gains(law, axes, seed), PERIOD)


def test_all_laws_are_found_by_name() -> None:
    assert set(laws()) == {*EQUATIONS, "slotine_li"}  # whose equations are in test_slotine_li
    for name in laws():
        assert find_law(name).name == name


@pytest.mark.parametrize("name", EQUATIONS)
@pytest.mark.parametrize("axes", [4, 9, 10])
def test_force_is_the_equation(name: str, axes: int) -> None:
    """Over several ticks, so that integrals and last values count."""
    law, history = find_law(name), History(axes, seed=axes)
    gains = random_gains(law, axes, seed=1)
    expected = EQUATIONS[name](history, gains)
    actual = forces(law(gains, PERIOD), history)
    np.testing.assert_allclose(actual, expected, rtol=1e-11, atol=1e-12)


def test_a_gain_named_as_a_word_of_python_has_its_name_for_the_user() -> None:
    law = find_law("tde_stc")
    assert list(law.gain_descriptions()) == ["h_bar", "lambda", "k_1", "k_2"]
    assert law.gain_descriptions()["lambda"] == "slope of the sliding surface (38), 1/s"
    built = law({name: np.full(9, k) for k, name in enumerate(law.gain_descriptions())}, PERIOD)
    assert built.gains.lambda_.tolist() == built.gain_values["lambda"].tolist() == [1.0] * 9


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_memory_is_a_laws_own_is_emptied_and_restored(name: str) -> None:
    """Bit for bit: after a reset the forces are those at first, laws of one class share nothing,
    gains and memory come back into a law that has other gains; signals are left alone."""
    history, law, twin, other = History(9, 3), law_of(name, 2), law_of(name, 2), law_of(name, 5)
    first = forces(law, history)
    np.testing.assert_array_equal(forces(twin, history), first)
    saved = law.save()
    remembered = forces(law, history)
    has_memory = name in ("tde_tsmc", "tde_stc", "dob", "adrc", *WITH_FRICTION)
    assert np.any(remembered != first) == has_memory, "a memory must show"
    forces(other, history)
    other.restore(saved)
    for value, restored in zip(law.gain_values.values(), other.gain_values.values(), strict=True):
        np.testing.assert_array_equal(restored, value)
    np.testing.assert_array_equal(forces(other, history), remembered)
    law.reset()
    np.testing.assert_array_equal(forces(law, history), first)
    block = history.block(0)
    before = block.tobytes()
    law.force(Signals.view(block))
    assert block.tobytes() == before


@pytest.mark.parametrize("name", [name for name in EQUATIONS if name.startswith("tde")])
def test_with_h_bar_zero_the_estimate_has_the_nominal_inertia(name: str) -> None:
    """The law is told so by its gain, also when it is changed; its own force has no h_bar u."""
    law, history = find_law(name), History(9, 2)
    gains = random_gains(law, 9, seed=1)
    built = law(gains, PERIOD)
    built.gain_values = {**gains, "h_bar": np.zeros(9)}
    assert (built.estimate, built.needs_model, built.uses_model) == (NOMINAL_INERTIA, True, False)
    switching = (
        gains["g"] * np.sign(history.edot + gains["lambda"] * history.e) if "g" in gains else 0
    )
    np.testing.assert_allclose(forces(built, history), history.n_hat + switching, rtol=1e-14)
    built.gain_values = gains
    assert (built.estimate, built.needs_model) == (CONSTANT_INERTIA, False)


def test_the_integral_in_the_manual_is_kept_and_begins_at_zero(tmp_path: Path) -> None:
    """At the start, and when the law takes over again."""
    manual = (ROOT / "docs/manual/own_law.md").read_text("utf-8")
    module = re.search(r"```python\n(# my_pid.py.*?)```", manual, re.DOTALL)
    assert module
    (tmp_path / "my_pid.py").write_text(module[1])
    plan = Scenario(
        controller=f"{tmp_path}/my_pid.py:Pid",
        gains={"pid": {"k_p": [100.0], "k_i": [100.0], "k_d": [20.0]}},
        case="3",
        duration=0.05,
    )
    for swaps, start in (([], 0), (["0.02:ctc", "0.03:pid"], 60)):
        flight = Flight(resolve(plan.model_copy(update={"swaps": swaps})))
        errors = simulate(flight).telemetry[start:, 3]  # type: ignore[index]
        integral = flight.laws["pid"].memory.integral
        np.testing.assert_allclose(integral, PERIOD * errors.sum(axis=0), rtol=1e-9)
        assert integral.any()


def test_numba_finds_one_type_for_all_laws_and_keeps_it() -> None:
    """Else a kernel that is called with a law looks for the type anew, at every tick."""
    flown = Flight(resolve(Scenario())).laws.values()
    codes = [law.code for law in flown if isinstance(law, CompiledLaw)]
    first, again = ([numba.typeof(code) for code in codes] for _ in range(2))
    assert len(codes) == len(laws())
    assert set(first) == {first[0]}
    assert [id(kind) for kind in first] == [id(kind) for kind in again]
    parts = [numba.typeof(part) for part in codes[0]]
    assert list(first[0].types) == parts


def test_gains_against_friction_are_zero_and_not_told_of_unless_they_are_given() -> None:
    """Given as zero they are, as after a change in flight; and a missing one of others is none."""
    for name, law in laws().items():
        assert law.optional_gains() == (OPTIONAL if name in WITH_FRICTION else set())
    ctc, required = find_law("ctc"), {"k_p": [4.0], "k_d": [2.0]}
    gains = check_gains(required, ctc, 9, "here")
    law = ctc(gains, PERIOD)
    assert set(law.gain_values) == {*required, *OPTIONAL}
    assert not any(law.gain_values[name].any() for name in OPTIONAL)
    assert set(law.given_gains) == set(law.in_force(0).gains) == set(required)
    law.gain_values = {**law.gain_values, "coulomb": np.ones(9)}
    assert set(law.in_force(1).gains) == {*required, "coulomb"}
    law.gain_values = gains
    assert law.in_force(2).gains["coulomb"] == (0.0,) * 9
    given = ctc(check_gains({**required, "k_i": [0.0]}, ctc, 9, "here"), PERIOD)
    assert list(given.given_gains) == ["k_p", "k_d", "k_i"]
    with pytest.raises(InputError, match=r"ctc.k_d: missing"):
        check_gains({"k_p": [1.0]}, ctc, 9, "here")
    with pytest.raises(InputError, match="unknown gain of ctc 'k_j' in here: choose one of k_p,"):
        check_gains({**required, "k_j": [1.0]}, ctc, 9, "here")


@pytest.mark.parametrize("name", [name for name in WITH_FRICTION if name in EQUATIONS])
def test_gains_of_zero_keep_the_bits_of_the_law_without_them(name: str) -> None:
    """Of zeros with a sign, too: what is added is nothing."""
    law, history = find_law(name), History(9, 4)
    for signal in (history.e, history.edot, history.bias, history.rhodd_d):
        signal[3] = -0.0
    gains = {**random_gains(law, 9, 1), **dict.fromkeys(OPTIONAL, np.zeros(9))}
    plain = dict(gains)
    for gain in OPTIONAL:
        del plain[gain]
    built = law(plain, PERIOD)
    force = forces(built, history)
    assert force.tobytes() == forces(law(gains, PERIOD), history).tobytes()
    if name == "pd":
        expected = gains["k_p"] * history.e + gains["k_d"] * history.edot
        assert force.tobytes() == expected.tobytes()
    assert not built.memory.integral.any()


@pytest.mark.parametrize("name", WITH_FRICTION)
def test_an_integral_waits_at_the_limit_and_leaves_it_at_once(name: str) -> None:
    """With a tenth applied of what was asked; then the error has the other sign."""
    law = find_law(name)
    gains = {**random_gains(law, 9, 1), "k_i": np.ones(9)}
    if name == "slotine_li":
        gains["k_d"] *= 1e4  # what is asked has the sense of the error
    built, history, sums = law(gains, PERIOD), History(9, 5), []
    history.edot[:], history.rhodd_d[:], history.bias[:] = 0.0, 0.0, 0.0
    history.rates_d[:], history.rho_rate[:], history.inertia[:] = 0.0, 0.0, np.eye(9)
    history.e[:], history.e[-1] = 0.5, -0.5
    for k in range(TICKS):
        history.applied[k] = (1.0 if k < 2 else 0.1) * built.memory.force
        block = history.block(k)
        signals = Signals.view(block)
        signals.quaternion[0] = signals.attitude_error[0] = signals.reference.quaternion[0] = 1.0
        assign(block[0], model=find_robot("paper").model)
        built.force(signals)
        sums.append(built.memory.integral.copy())
    steps = np.diff(sums, axis=0, prepend=np.zeros((1, 9))) / (0.5 * PERIOD)
    np.testing.assert_allclose(steps[:2], 1.0)
    assert not steps[2:-1].any()
    np.testing.assert_allclose(steps[-1], -1.0)


def test_each_gain_says_where_to_search_for_it() -> None:
    """The shipped sets are inside, by the largest and smallest inertia that an axis may have."""
    for law in laws().values():
        assert law.gain_ranges().keys() == law.gain_descriptions().keys()
        for gain, span in law.gain_ranges().items():
            assert span.is_optional == (gain in OPTIONAL)
            assert law.gain_descriptions()[gain].endswith(span.unit)
            for file in (ROOT / "config/gains").glob(f"*/*/{law.name}.yaml"):
                if span.is_optional or span.per_inertia or file.parent.name == "printed":
                    continue
                axes = find_robot(file.parents[1].name).n + 3
                values = read_gains(file, law, axes)[gain]
                assert np.all((span.lower <= values) & (values <= span.upper)), (file, gain)
    ctc = laws()["ctc"].gain_ranges()
    assert ctc["k_d"] == GainRange(0.1, 1e3, "log", "1/s", per_inertia=False, is_optional=False)
    assert laws()["pd"].gain_ranges()["k_d"].per_inertia
    assert laws()["slotine_li"].gain_ranges()["spread"].scale == "linear"


@pytest.mark.parametrize(
    ("search", "scale"), [((1.0, 1.0), "log"), ((0.0, 1.0), "log"), ((0.0, 1.0), "cubic")]
)
def test_a_range_that_is_none_is_refused(search: tuple[float, float], scale: Any) -> None:
    with pytest.raises(ValueError, match=r"K: "):
        per_axis("K", "1/s", search=search, scale=scale)


@given(st.floats(-1e3, 1e3), st.floats(1e-6, 10.0))
def test_saturation_is_odd_bounded_and_linear_inside_the_layer(s: float, delta: float) -> None:
    """(58)."""
    value = saturation(s, delta)
    assert saturation(-s, delta) == -value
    assert abs(value) <= 1.0
    assert value * s >= 0.0
    assert value == (np.sign(s) if abs(s) > delta else s / delta)
