"""Tables and numbers that README and docs/ show are those that the commands print."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from shown import NUMBER, ROOT, block, check, run, step


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two bags of docs/manual/analysis.md, made by its first two commands."""
    folder = tmp_path_factory.mktemp("flights")
    run("simulate", "--bag", str(folder / "one"))
    run("simulate", "--controller", "tde_smc", "--case", "3", "--bag", str(folder / "two"))
    return folder


def test_the_table_of_readme_is_what_simulate_prints() -> None:
    """So what `fly` prints: they are the same to the bit."""
    shown = block("README.md", "tde_stc, case 1, gains default:", "messages lost: none")
    check(shown, run("simulate"), "tde_stc, case 1")


def test_the_sizing_of_analysis_is_what_analyze_prints(bags: Path) -> None:
    """Four small wheels beside what the first bag asked of its base."""
    shown = block("docs/manual/analysis.md", "what actuators small_wheels", "stored momentum")
    printed = run("analyze", str(bags / "one"), "--actuators", "small_wheels", columns=100)
    check(shown, printed, "what actuators small_wheels")


def test_the_verdicts_of_requirements_are_what_trace_prints() -> None:
    shown = block("docs/manual/requirements.md", "Requirements of the paper's", "3 requirements: ")
    ids = ("--only", "PNT-001,PNT-003,TRK-001")
    check(shown, run("trace", *ids, "--workers", "0", columns=110), "Requirements of the paper's")


def test_a_bag_is_as_large_as_the_page_says(bags: Path) -> None:
    """To a hundredth: versions of lz4 compress a little differently."""
    text = (ROOT / "docs/manual/bags.md").read_text("utf-8")
    (size,) = re.findall(r"\| `lz4` \(default\) \| ([\d.]+) MB", text)
    written = sum(path.stat().st_size for path in (bags / "one").iterdir())
    assert float(size) == pytest.approx(written / 1e6, rel=0.01)


def test_the_page_on_missions_has_the_demands_that_plan_prints() -> None:
    """Of the paper's mission, as it is and made lighter."""
    for label, *options in (
        ("as it is",),
        ("`--base-torque 0.5`", "--base-torque", "0.5"),
        ("`--momentum 4`", "--momentum", "4"),
    ):
        printed = run("plan", *options)
        (flown,) = re.findall(
            r"^([\d.]+) s; largest base torque ([\d.]+) N m, largest momentum ([\d.]+) N m s$",
            printed,
            re.MULTILINE,
        )
        text = (ROOT / "docs/manual/missions.md").read_text("utf-8")
        (row,) = re.findall(rf"^\| {re.escape(label)} \|(.*)\|$", text, re.MULTILINE)
        for cell, number in zip(map(str.strip, row.split("|")), flown, strict=True):
            # one in the last place: where bends stop depends on the processor's BLAS
            assert float(cell) == pytest.approx(float(number), abs=1.01 * step(cell)), label


def test_the_page_on_stability_has_the_numbers_of_its_command() -> None:
    """Case 1 under TDE-STC, the first command of the page."""
    report = json.loads(run("stability", "--json"))
    twisting, lemma = report["super_twisting"], report["lemma_1"]
    lmi, unlike = twisting["lmi"], report["time_delay_error"]["without_friction"]["beta"]
    excess = [axis["value"] / axis["limit"] for axis in twisting["beta_below_k_2"]]
    bounds = twisting["reaching"]["reaching_time_s_below_bound"]
    reaching = [(axis["value"], axis["limit"]) for axis in bounds]
    base, joints = reaching[:3], reaching[3:]
    eigenvalues = [axis["value"] for axis in lmi["residual_of_paper_m_at_beta_0_gamma_0"]]
    gammas = [axis["gamma"] for axis in lmi["assumed_beta_half_of_tolerated"]]
    without_friction = [beta / k_2 for beta, k_2 in zip(unlike, twisting["k_2"], strict=True)]
    expected: list[list[float]] = [
        [lemma["spectral_norm"]["max"]],
        [lemma["spectral_radius"]["max"]],
        [min(excess), max(excess), min(without_friction), max(without_friction)],
        [],
        [min(eigenvalues), max(eigenvalues), 0.0],
        [],
        [min(gammas), max(gammas)],
        [
            max(t for t, _ in base),
            *(pick(t for t, _ in joints) for pick in (min, max)),
            min(limit for _, limit in base),
            *(pick(limit for _, limit in joints) for pick in (min, max)),
        ],
    ]
    first, last = "| Lemma 1, spectral norm", "| reaching time below (56)"
    rows = block("docs/explanation/stability.md", first, last)
    for row, computed in zip(rows, expected, strict=True):
        shown = NUMBER.findall(row.split("|")[2])
        assert [float(text) for text in shown] == [
            pytest.approx(number, abs=1.51 * step(text))  # one in the last place
            for text, number in zip(shown, computed, strict=True)
        ]
    assert lemma["spectral_norm"]["max"] > 1.0 > lemma["spectral_radius"]["max"]
    assert all(axis["holds"] for axis in twisting["4_k_2_below_k_1_squared"])
    assert not any(axis["applies"] for axis in bounds)
    assert not any(axis["holds"] for axis in twisting["beta_below_k_2"])
    assert set(lmi["measured_beta"]) == {None}


def test_the_page_on_campaigns_has_what_its_commands_print(tmp_path: Path) -> None:
    """The shipped campaign of 20 runs, and one of its flights again."""
    folder = str(tmp_path / "a")
    printed = run("campaign", "run", "first", "--seed", "7", "--out", folder, "--workers", "0")
    shown = block("docs/manual/campaigns.md", "20 runs, seed 7", "# the worst")
    check(shown, printed.replace(folder, "campaigns/a"), "20 runs, seed 7")
    again = run("campaign", "rerun", folder, "11", "--law", "ctc")
    assert "same digest as the row: " in again
