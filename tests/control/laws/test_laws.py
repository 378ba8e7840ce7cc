"""Each law against a transcription of its equation, over whole histories of signals at once."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from paths import ROOT

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import (
    CompiledLaw,
    ControlLaw,
    LawGains,
    LawMemory,
    Signals,
    find_law,
    laws,
    per_axis,
)
from space_robot_control.laws.ctc_smc import saturation
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]
Gains = dict[str, Array]

PERIOD = 5e-4
TICKS = 12


class History:
    """Random signals of ``TICKS`` ticks, (TICKS, m) each."""

    def __init__(self, axes: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.e, self.edot, self.rhodd_d, self.n_hat, self.bias = rng.normal(size=(5, TICKS, axes))
        # errors of all sizes, some of them zero: sign, root and boundary layer matter there
        self.e *= 10.0 ** rng.uniform(-6.0, 0.0, self.e.shape)
        self.edot *= 10.0 ** rng.uniform(-6.0, 0.0, self.edot.shape)
        nothing = rng.random(self.e.shape) < 0.1
        self.e[nothing] = self.edot[nothing] = 0.0
        root = rng.normal(size=(TICKS, axes, axes))
        self.inertia = root @ root.transpose(0, 2, 1)

    def at(self, k: int) -> Signals:
        signals = Signals.view(Signals.block(self.e.shape[1] - 3))
        signals.error[:], signals.error_rate[:] = self.e[k], self.edot[k]
        signals.acceleration_desired[:], signals.n_hat[:] = self.rhodd_d[k], self.n_hat[k]
        signals.nominal.inertia[:], signals.nominal.bias[:] = self.inertia[k], self.bias[k]
        return signals

    def through_model(self, u: Array) -> Array:
        """H_S u + c_S at every tick."""
        return np.einsum("kij,kj->ki", self.inertia, u) + self.bias


def sign_root(s: Array) -> Array:
    """|s|^1/2 sign(s)."""
    return np.sign(s) * np.abs(s) ** 0.5


def ctc(h: History, g: Gains) -> Array:
    """(30), (31)."""
    return h.through_model(h.rhodd_d + g["k_d"] * h.edot + g["k_p"] * h.e)


def ctc_smc(h: History, g: Gains) -> Array:
    """(57), (58)."""
    s = h.edot + g["lambda"] * h.e
    sat = np.where(np.abs(s) > g["delta"], np.sign(s), s / g["delta"])
    return h.through_model(h.rhodd_d + g["lambda"] * h.edot) + g["g"] * sat


def tde_smc(h: History, g: Gains) -> Array:
    """(59)."""
    s = h.edot + g["lambda"] * h.e
    return g["h_bar"] * (h.rhodd_d + g["lambda"] * h.edot) + h.n_hat + g["g"] * np.sign(s)


def tde_tsmc(h: History, g: Gains) -> Array:
    """(60); the integral of edd is edot - edot(0), the rest summed from the second tick on."""
    u_pd = h.rhodd_d + g["k_d"] * h.edot + g["k_p"] * h.e
    summed = np.cumsum((g["k_d"] * h.edot + g["k_p"] * h.e)[1:], axis=0) * PERIOD
    s = h.edot - h.edot[0] + np.vstack([np.zeros_like(h.e[:1]), summed])
    return g["h_bar"] * (u_pd + g["k_1"] * sign_root(s)) + h.n_hat


def tde_stc(h: History, g: Gains) -> Array:
    """(41), (42)."""
    s = h.edot + g["lambda"] * h.e
    integral = np.cumsum(g["k_2"] * np.sign(s), axis=0) * PERIOD
    u = h.rhodd_d + g["lambda"] * h.edot + g["k_1"] * sign_root(s) + integral
    return g["h_bar"] * u + h.n_hat


EQUATIONS: dict[str, Callable[[History, Gains], Array]] = {
    "ctc": ctc,
    "ctc_smc": ctc_smc,
    "tde_smc": tde_smc,
    "tde_tsmc": tde_tsmc,
    "tde_stc": tde_stc,
}


def random_gains(law: type[ControlLaw], axes: int, seed: int) -> Gains:
    rng = np.random.default_rng(seed)
    gains = {name: rng.uniform(0.1, 5.0, axes) for name in law.gain_descriptions()}
    if "delta" in gains:
        gains["delta"] *= 1e-2
    return gains


def forces(law: ControlLaw, history: History) -> Array:
    return np.array([law.force(history.at(k)).copy() for k in range(TICKS)])


def test_the_five_laws_are_found_by_name() -> None:
    assert set(laws()) == set(EQUATIONS)
    for name in EQUATIONS:
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


def listed_backwards(record: type[Any], base: type[Any]) -> type[Any]:
    """The same fields in the opposite order, all of them behind those of ``base``."""
    own = [item for item in record.fields().items() if item[0] not in base.fields()]
    backwards = type("Backwards", (base,), dict(reversed(own)))
    assert list(backwards.fields()) == [*base.fields(), *(name for name, _ in reversed(own))]
    return backwards


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_order_of_listing_changes_nothing(name: str) -> None:
    """Gains and memory go by name: swapped lines of a law's declarations command the same."""
    law, history = find_law(name), History(9, seed=8)
    assert issubclass(law, CompiledLaw)

    class Backwards(law):  # type: ignore[misc, valid-type]
        gains_type = listed_backwards(law.gains_type, LawGains)
        memory_type = listed_backwards(law.memory_type, LawMemory)

    gains = random_gains(law, 9, seed=9)
    swapped = Backwards(dict(reversed(gains.items())), PERIOD)
    as_listed = law(gains, PERIOD)
    assert swapped.gains_block.tobytes() != as_listed.gains_block.tobytes()
    np.testing.assert_array_equal(forces(swapped, history), forces(as_listed, history))
    for signal in ("s", "u"):
        now, then = getattr(swapped.memory, signal), getattr(as_listed.memory, signal)
        np.testing.assert_array_equal(now, then)


def test_a_gain_named_as_a_word_of_python_has_its_name_for_the_user() -> None:
    law = find_law("tde_stc")
    assert list(law.gain_descriptions()) == ["h_bar", "lambda", "k_1", "k_2"]
    assert law.gain_descriptions()["lambda"] == "slope of the sliding surface (38), 1/s"
    built = law({name: np.full(9, k) for k, name in enumerate(law.gain_descriptions())}, PERIOD)
    assert built.gains.lambda_.tolist() == built.gain_values["lambda"].tolist() == [1.0] * 9


@pytest.mark.parametrize("name", EQUATIONS)
def test_reset_empties_the_memory(name: str) -> None:
    """After it the same signals give the same forces as at first, bit for bit."""
    law, history = find_law(name)(random_gains(find_law(name), 9, seed=2), PERIOD), History(9, 3)
    first = forces(law, history)
    remembered = forces(law, history)
    law.reset()
    np.testing.assert_array_equal(forces(law, history), first)
    if name in ("tde_tsmc", "tde_stc"):
        assert np.any(remembered != first), "these two have a memory that must show"


@pytest.mark.parametrize("name", EQUATIONS)
def test_a_law_restored_goes_on_as_the_one_that_was_saved(name: str) -> None:
    """Gains and memory come back into a law that has other gains and has answered for long."""
    law, history = find_law(name)(random_gains(find_law(name), 9, seed=2), PERIOD), History(9, 3)
    forces(law, history)
    saved = law.save()
    expected = forces(law, history)
    other = find_law(name)(random_gains(find_law(name), 9, seed=5), PERIOD)
    forces(other, history)
    other.restore(saved)
    for value, restored in zip(law.gain_values.values(), other.gain_values.values(), strict=True):
        np.testing.assert_array_equal(restored, value)
    np.testing.assert_array_equal(forces(other, history), expected)


@pytest.mark.parametrize("name", EQUATIONS)
def test_laws_of_one_class_share_nothing(name: str) -> None:
    law, history = find_law(name), History(9, 4)
    gains = random_gains(law, 9, seed=3)
    one, other = law(gains, PERIOD), law(gains, PERIOD)
    expected = forces(one, history)
    np.testing.assert_array_equal(forces(other, history), expected)


@pytest.mark.parametrize("name", EQUATIONS)
def test_force_leaves_the_signals_alone(name: str) -> None:
    law, history = find_law(name), History(9, 5)
    signals = history.at(0)
    law(random_gains(law, 9, seed=4), PERIOD).force(signals)
    before = history.at(0)
    for name in Signals.fields().keys() - {"nominal"}:
        np.testing.assert_array_equal(getattr(signals, name), getattr(before, name))
    for name in ("inertia", "bias"):
        now, then = getattr(signals.nominal, name), getattr(before.nominal, name)
        np.testing.assert_array_equal(now, then)


def test_terminal_surface_starts_at_zero_whatever_the_error() -> None:
    """(60) with s(0) = 0, also after a reset: the first force is that of u_PD alone."""
    law, history = find_law("tde_tsmc"), History(9, 6)
    gains = random_gains(law, 9, seed=5)
    controller = law(gains, PERIOD)
    for k in (0, 7):
        controller.reset()
        force = controller.force(history.at(k))
        np.testing.assert_array_equal(controller.memory.s, np.zeros(9))
        u_pd = history.rhodd_d[k] + gains["k_d"] * history.edot[k] + gains["k_p"] * history.e[k]
        np.testing.assert_allclose(force, gains["h_bar"] * u_pd + history.n_hat[k], rtol=1e-13)


def test_model_and_time_delay_estimate_go_to_the_laws_that_say_so() -> None:
    given = {n: (law.uses_model, law.uses_time_delay_estimate()) for n, law in laws().items()}
    model, estimate = (True, False), (False, True)
    assert given == {
        "ctc": model,
        "ctc_smc": model,
        "tde_smc": estimate,
        "tde_tsmc": estimate,
        "tde_stc": estimate,
    }


@given(st.floats(-1e3, 1e3), st.floats(1e-6, 10.0))
def test_saturation_is_odd_bounded_and_linear_inside_the_layer(s: float, delta: float) -> None:
    """(58)."""
    value = saturation(s, delta)
    assert saturation(-s, delta) == -value
    assert abs(value) <= 1.0
    assert value * s >= 0.0
    assert value == (np.sign(s) if abs(s) > delta else s / delta)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(1e-3, 1.0))
def test_saturation_never_falls_and_has_no_step(a: float, b: float, delta: float) -> None:
    """Lipschitz with 1/Delta, so continuous at the layer's edge."""
    low, high = min(a, b), max(a, b)
    rise = saturation(high, delta) - saturation(low, delta)
    assert 0.0 <= rise <= (high - low) / delta + 1e-12


class LeadGains(LawGains):
    h_bar: Array = per_axis("constant inertia", "kg m2")
    k: Array = per_axis("derivative gain", "1/s")


class LeadLaw(ControlLaw):
    """A sixth law, as a user would write it: PD on the time-delay estimate."""

    name = "lead"
    gains_type = LeadGains

    def force(self, signals: Signals) -> Array:
        force: Array = self.gains.h_bar * self.gains.k * signals.error_rate + signals.n_hat
        return force


def test_a_law_of_ones_own_is_found_by_module_and_class() -> None:
    law = find_law(f"{__name__}:LeadLaw")
    assert law.name == "lead"
    assert law.uses_time_delay_estimate()
    history = History(4, 7)
    force = law({"h_bar": np.full(4, 2.0), "k": np.full(4, 3.0)}, PERIOD).force(history.at(2))
    np.testing.assert_allclose(force, 6.0 * history.edot[2] + history.n_hat[2])
    assert "lead" not in laws(), "only a file in the laws' folder gets a name of its own"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("pid", "unknown controller 'pid'"),
        ("space_robot_control.laws.ctc:Pid", "has no attribute 'Pid'"),
        ("space_robot_control.laws.ctc:", "cannot be imported"),
        ("space_robot_model.robot:Robot", "is not a ControlLaw"),
        ("math:pi", "is not a ControlLaw"),
        (":Law", "cannot be imported"),
        ("space_robot_control.laws:ControlLaw", "is not a ControlLaw"),
    ],
)
def test_unknown_laws_are_errors_that_name_the_allowed_ones(name: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as caught:
        find_law(name)
    assert repr(name) in str(caught.value)
    for allowed in (*EQUATIONS, "module:Class"):
        assert allowed in str(caught.value)


def test_a_missing_gain_is_an_error() -> None:
    with pytest.raises(KeyError, match="k_d"):
        find_law("ctc")({"k_p": np.ones(9)}, PERIOD)


def test_the_law_of_ones_own_in_the_manual_flies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its two files to the letter."""
    manual = (ROOT / "docs/manual/control_laws.md").read_text("utf-8")
    module, gains = (
        re.search(rf"```{language}\n(# {name}.*?)```", manual, re.DOTALL)
        for language, name in (("python", "my_laws.py"), ("yaml", "gains/tde.yaml"))
    )
    assert module
    assert gains
    (tmp_path / "my_laws.py").write_text(module[1])
    (tmp_path / "gains").mkdir()
    (tmp_path / "gains/tde.yaml").write_text(gains[1])
    monkeypatch.syspath_prepend(tmp_path)
    own = "my_laws:TimeDelayControl"
    flight = Flight(resolve(FlightPlan(controller=own, gains=f"{tmp_path}/gains", duration=0.05)))
    errors = simulate(flight).telemetry[:, 3]  # type: ignore[index]
    assert np.abs(errors).max() < 1e-6
