"""``space-robot stability``: what it prints, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.image
import pytest
import yaml
from click.testing import CliRunner
from closed_loop import GAINS

from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, FlightPlan
from space_robot.flight.simulate import simulate
from space_robot.paper.stability import StabilityStudy, report, study
from space_robot.paper.stability.check import Check
from space_robot.paper.stability.figures import draw
from space_robot_msgs_py.errors import InputError


def run(*arguments: str) -> str:
    """Standard output of the command."""
    result = CliRunner().invoke(cli, ["stability", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def studied(**options: Any) -> StabilityStudy:
    plan = FlightPlan.model_validate({"duration": 0.5, **options})
    return study(plan, 1e-3, lambda flight, which: simulate(flight))


@pytest.fixture(scope="module")
def printed() -> dict[str, Any]:
    """Case 1 with the gains of Table IV, long enough for the joints to arrive."""
    found: dict[str, Any] = json.loads(run("--duration", "2", "--gains", "printed", "--json"))
    return found


def test_printed_gains_of_case_1(printed: dict[str, Any]) -> None:
    lemma_1, twisting = printed["lemma_1"], printed["super_twisting"]
    assert lemma_1["spectral_norm_below_1"]["holds"] is False
    assert lemma_1["spectral_radius_below_1"]["holds"] is True
    assert printed["axes"] == ["base_x", "base_y", "base_z", *(f"joint{i}" for i in range(1, 7))]
    for key, holds in {
        "beta_below_k_2": False,
        "4_k_2_below_k_1_squared": True,
        "circle_criterion": False,
    }.items():
        assert [check["holds"] for check in twisting[key]] == [holds] * 9
    assert twisting["tolerated_beta"] == twisting["k_2"]
    lmi = twisting["lmi"]
    assert not any(x["holds"] for x in lmi["residual_of_paper_m_at_beta_0_gamma_0"])
    assert lmi["measured_beta"] == [None] * 9
    for k_2, solved in zip(twisting["k_2"], lmi["assumed_beta_half_of_tolerated"], strict=True):
        assert solved["beta"] == pytest.approx(k_2 / 2)
        assert solved["gamma"] > 0.0
        assert solved["residual"] <= 0.0


def test_tables_name_every_condition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = run("--duration", "0.2", "--no-friction")
    for words in ("(69)", "(65)", "(46)", "(73)", "(48)", "(51)", "(56)", "holds", "fails"):
        assert words in text
    assert "sufficient" in text
    assert "…" not in text


def test_other_laws_get_what_applies_to_them() -> None:
    for law in ("tde_smc", "tde_tsmc"):
        found = report(studied(controller=law, duration=0.1))
        assert found["super_twisting"] is None
        assert len(found["time_delay_error"]["as_flown"]["beta"]) == 9
    assert "do not apply" in run("--controller", "tde_smc", "--duration", "0.1")


def test_seven_joints(tmp_path: Path) -> None:
    found = studied(robot="seven_joint")
    data = report(found)
    assert len(data["axes"]) == len(data["super_twisting"]["k_1"]) == 10
    assert len(draw(found, tmp_path)) == 4


def test_report_of_infinite_numbers_is_json(tmp_path: Path) -> None:
    """K_1 = 0 has an infinite peak and no M: null, and the command still ends well."""
    path = tmp_path / "tde_stc.yaml"
    gains = {**GAINS["tde_stc"], "k_1": [0.0]}
    path.write_text(yaml.safe_dump({"controller_node": {"ros__parameters": {"tde_stc": gains}}}))
    found = studied(gains=str(path), duration=0.05)
    data = json.loads(json.dumps(report(found), allow_nan=False))["super_twisting"]
    assert data["circle_criterion"][0]["value"] is None
    assert data["circle_criterion"][0]["holds"] is False
    assert data["lmi"]["assumed_beta_half_of_tolerated"] == [None] * 9
    assert data["reaching"]["reaching_time_s_below_bound"][0]["holds"] is None
    assert len(draw(found, tmp_path / "figures")) == 4


def test_pictures_are_the_same_bytes_twice(tmp_path: Path) -> None:
    found = studied(duration=0.1)
    first, second = (draw(found, tmp_path / name) for name in ("a", "b"))
    assert [path.name for path in first] == [
        "nyquist.png",
        "nyquist.svg",
        "lyapunov.png",
        "lyapunov.svg",
    ]
    for one, two in zip(first, second, strict=True):
        assert one.read_bytes() == two.read_bytes()
    assert matplotlib.image.imread(first[0]).std() > 0.01


def test_flight_of_a_few_ticks_is_refused() -> None:
    with pytest.raises(InputError, match="10 ticks"):
        study(FlightPlan(duration=0.002), 1e-3, lambda flight, which: simulate(flight))


def test_law_is_looked_at_before_anything_flies() -> None:
    def never(flight: Flight, which: str) -> Any:
        raise AssertionError(which)

    with pytest.raises(InputError):
        study(FlightPlan(controller="ctc_smc"), 1e-3, never)


def test_a_check_of_unknown_numbers_is_open() -> None:
    assert Check(1.0, 2.0, applies=False).verdict == "not applicable"
    assert (Check(1.0, 2.0).verdict, Check(2.0, 2.0).verdict) == ("holds", "fails")
    assert Check(float("nan"), 2.0).verdict == Check(1.0, float("nan")).verdict == "open"
