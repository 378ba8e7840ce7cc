"""The choice of a law: search space, fronts, candidates, files."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

from space_robot.choice.candidates import Candidate, FlownCandidate, select
from space_robot.choice.criteria import CRITERIA
from space_robot.choice.front import Front, Goal, Tried
from space_robot.choice.law_search import has_estimate
from space_robot.choice.search_space import FASTEST_HZ, SLOWEST_HZ, GainPoint, SearchSpace
from space_robot.choice.stability import SmallMotions
from space_robot.choice.trials import Score
from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.tuning.gain_check import check_gains
from space_robot.tuning.inertia import inertia_along, postures_along
from space_robot_control.laws import find_law, laws
from space_robot_msgs_py.errors import InputError

FRICTION = np.array([[0.15, 0.8]] * 6)
SHORT = ("--evaluations", "10", "--runs", "2", "--duration", "1.1", "--workers", "0")


def choose(*words: str) -> Result:
    return CliRunner().invoke(cli, ("choose", *words))


def space(law: str, corner_hz: float = 30.0) -> SearchSpace:
    gains = resolve(Scenario(controller=law, gains="tuned")).law.gain_values
    start = GainPoint(gains, corner_hz)
    return SearchSpace(find_law(law), start, FRICTION, True, has_estimate(law))


@pytest.mark.parametrize("law", laws())
def test_a_search_begins_at_the_tuned_gains_with_the_known_friction(law: str) -> None:
    searched = space(law)
    begun = searched.at(searched.origin)
    for name, values in searched.start.gains.items():
        if name in ("coulomb", "viscous"):
            np.testing.assert_allclose(begun.gains[name][3:], FRICTION[:, int(name == "viscous")])
            assert not begun.gains[name][:3].any(), "the base has no friction"
        elif name not in ("k_i", "dead_band", "bandwidth", "omega_o"):
            np.testing.assert_allclose(begun.gains[name], values, rtol=1e-12)
    low, high = searched.at(np.zeros(searched.dimension)), searched.at(np.ones(searched.dimension))
    if has_estimate(law):
        assert low.corner_hz == pytest.approx(SLOWEST_HZ)
        assert high.corner_hz == pytest.approx(FASTEST_HZ)


def test_gains_of_one_bandwidth_move_as_its_powers_and_on_their_own_axes() -> None:
    searched = space("ctc")
    (base,) = (k for k, c in enumerate(searched.coordinates) if c.label == "base bandwidth")
    coordinate, point = searched.coordinates[base], searched.origin
    point[base] = 1.0
    ratio = {name: searched.at(point).gains[name] / searched.start.gains[name] for name in KP_KD}
    np.testing.assert_allclose(ratio["k_d"][:3], coordinate.highest)
    np.testing.assert_allclose(ratio["k_p"][:3], coordinate.highest**2)
    np.testing.assert_allclose([ratio[name][3:] for name in KP_KD], 1.0)


def test_motions_grow_at_other_gains_than_those_tuned_and_viscous_friction_damps_them() -> None:
    """Of PD with an integral: along the mission, as `gains check` has it without friction."""
    flight = Flight(resolve(Scenario(controller="pd", gains="tuned")))
    tuned = flight.law.gain_values
    integral = {**tuned, "k_i": 0.6 * tuned["k_p"] ** 2 / tuned["k_d"]}
    free, damped = (SmallMotions(flight, 1.0, share, False) for share in (0.0, 1.0))
    laws = [type(flight.law)(gains, flight.period) for gains in (tuned, integral)]
    checked = [
        check_gains(law, inertia_along(flight.robot, flight.mission_settings, 1.0), postures)
        for postures in [postures_along(flight.robot, flight.mission_settings, 1.0)]
        for law in laws
    ]
    for law, check in zip(laws, checked, strict=True):
        assert (free.growth(law, 0.0) <= 0.0) == check.loop.is_stable
        assert damped.growth(law, 0.0) < free.growth(law, 0.0)
    assert checked[0].loop.is_stable
    assert not checked[1].loop.is_stable
    fastest = (checked[1].loop.radius - 1.0) / flight.period
    assert free.growth(laws[1], 0.0) == pytest.approx(fastest, rel=0.1)


KP_KD = ("k_p", "k_d")
SHARES = st.floats(1e-6, 10.0)
ENDS = st.sampled_from([0.0, 0.5]), st.sampled_from([1.0, 0.3])
SCORES = st.builds(Score, SHARES, SHARES, *ENDS, st.booleans(), st.just({}))


@given(st.lists(SCORES, max_size=30), SHARES)
def test_nothing_tried_beats_the_front(scores: list[Score], ripple: float) -> None:
    front = Front("ctc", [Tried(np.zeros(1), score) for score in scores])
    free = [s for s in scores if not (s.beyond or s.held)]
    able = [s for s in free if s.flown == 1.0 and s.saturation == 0.0]
    for tried in front.best:
        assert tried.score in able
        assert not any(s.error < tried.score.error and s.ripple <= tried.score.ripple for s in able)
    least = min((s.error for s in able if s.ripple <= ripple), default=np.inf)
    chosen = front.within(ripple)
    assert (chosen.score.error if chosen else np.inf) == least
    assert chosen is None or front.nearest(Goal(ripple)).score.error == least


def test_where_ripple_is_too_large_the_search_goes_on_from_gains_that_control() -> None:
    scores = [Score(e, r, 0.0, 1.0, False, {}) for e, r in ((1, 0.06), (1e-3, 0.1), (1e-4, 2))]
    front = Front("ctc", [Tried(np.zeros(1), score) for score in scores])
    assert front.nearest(Goal(0.05)).score == scores[1]
    assert front.nearest(Goal(0.05, 1e-5)).score == scores[2]


def test_a_law_is_chosen_with_gains_that_fly_and_files_that_say_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("paper", "--law", "ctc", "--law", "tde_stc", *SHORT, "--json", "--ripple", "1")
    result = choose(*words, "--out", "a")
    assert result.exit_code == 0, result.exception
    report = json.loads(result.stdout)
    assert report["order"][0] == report["law"]
    assert set(report["order"]) | set(report["out"]) == {"ctc", "tde_stc"}
    own = resolve(Scenario(controller=report["law"], gains=f"a/{report['law']}/"))
    name = "k_d" if report["law"] == "ctc" else "k_1"
    gains = report["candidates"][report["law"]]["gains"][name]
    np.testing.assert_allclose(own.law.gain_values[name], gains, rtol=1e-9)
    for front in report["fronts"].values():
        assert [tried["ripple"] for tried in front] == sorted(t["ripple"] for t in front)
    assert report["sentence"] in Path("a/index.html").read_text("utf-8")
    study = yaml.safe_load(Path("a/campaign.yaml").read_text("utf-8"))
    assert study["laws"][0] == f"{report['law']}=a/{report['law']}/"
    again = json.loads(choose(*words, "--out", "b", "--workers", "1").stdout)
    for what in ("fronts", "candidates", "compared"):
        assert again[what] == report[what], "the same seed gives the same numbers"


def test_a_law_of_ones_own_takes_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(cli, ("new", "law", "my_law")).exit_code == 0
    own = "my_law.py:MyLaw"
    with_gains = ("--law", f"{own}=my_law.yaml", "--law", "ctc", *SHORT, "--ripple", "1")
    result = choose("paper", *with_gains, "--json", "--mass-uncertainty", "0")
    assert result.exit_code == 0, result.exception
    report = json.loads(result.stdout)
    assert set(report["fronts"]) == {"my_law", "ctc"}
    assert Path("choices/paper/my_law/my_law.yaml").is_file()
    study = yaml.safe_load(Path("choices/paper/campaign.yaml").read_text("utf-8"))
    assert f"{own}=choices/paper/my_law/" in study["laws"]
    assert "robot.base.mass" not in study["vary"]
    refused = choose("paper", "--law", own, *SHORT)
    assert isinstance(refused.exception, InputError)
    assert "my_law.py:MyLaw=GAINS" in str(refused.exception)


@pytest.mark.parametrize("words", [("--law", "ctc=x/"), ("--for", "pointing")])
def test_two_laws_of_one_name_or_a_base_without_errors_are_refused(words: tuple[str, ...]) -> None:
    result = choose("paper", "--law", "ctc", "--actuators", "none", *SHORT, *words)
    assert isinstance(result.exception, InputError)


def test_a_flight_too_short_to_judge_is_refused(tmp_path: Path) -> None:
    result = choose("paper", "--duration", "0.5", "--out", str(tmp_path))
    assert isinstance(result.exception, InputError)
    assert "1 s of flight or more, got 0.5 s" in str(result.exception)


def test_attitude_counts_as_much_as_all_joints() -> None:
    metrics = {"attitude_angle.rms": 4.0, "joints_1_3.rms": 1.0, "joints_4_6.rms": 16.0}
    error = CRITERIA["tracking"].error({**metrics, "base_torque.rms": 9.0})
    assert error == pytest.approx(4.0)


def test_the_first_law_must_pass_further_draws_with_these_gains_or_quieter_ones() -> None:
    # error of each gain set, and run from which on its flights end early
    sets = {"pd0": (1, 15), "pd1": (4, 99), "ctc0": (2, 99), "indi0": (0.5, 2), "indi1": (0.6, 3)}
    about = GainPoint({}, 0.0), Score(1.0, 1.0, 0.0, 1.0, False, {})
    flown: list[tuple[list[str], int, int]] = []

    def fly(candidates: Sequence[Candidate], runs: int, seed: int) -> list[FlownCandidate]:
        flown.append(([each.folder for each in candidates], runs, seed))
        found = []
        for each in candidates:
            error, end = sets[each.folder]
            rows = [{"attitude_angle.rms": error} if run < end else {} for run in range(runs)]
            found.append(FlownCandidate(each, rows))
        return found

    waiting = {
        law: iter([Candidate(law, law, *about, name) for name in sets if name[:-1] == law])
        for law in ("pd", "ctc", "indi")
    }
    by_law, order = select(waiting, fly, CRITERIA["tracking"], 6, 1)
    assert [each.candidate.folder for each in order] == ["ctc0", "pd1"]
    assert by_law["indi"].reason == "diverged in 3 of 6 flights"
    assert flown == [
        (["pd0", "ctc0", "indi0"], 6, 1),
        (["indi1"], 6, 1),
        (["pd0"], 18, 2),  # the first one is out in further draws
        (["pd1"], 6, 1),
        (["ctc0"], 18, 2),
    ]


@pytest.mark.parametrize("asked", [("--ripple", "10"), ("--error", "1"), ("--bandwidth", "4")])
def test_one_law_is_tuned_by_flights_for_what_is_asked(tmp_path: Path, asked: tuple[str]) -> None:
    words = ("--law", "ctc", "--case", "3", "--evaluations", "3", *asked, "-o", str(tmp_path))
    result = CliRunner().invoke(cli, ("gains", "tune", *words))
    assert result.exit_code == 0, result.exception
    gains = resolve(Scenario(controller="ctc", gains=f"{tmp_path}/")).law.gain_values
    if "--bandwidth" in asked:
        np.testing.assert_allclose(gains["k_p"][:3], 16.0)
    error = float(re.findall(r"error ([\d.e-]+), ripple", result.stderr)[0])
    assert 0.0 < error < 1.0


@pytest.mark.parametrize("sensors", ["ideal", "coarse"])  # coarse: the method finds no gains
def test_what_one_law_cannot_reach_is_refused(tmp_path: Path, sensors: str) -> None:
    words = ("--law", "ctc", "--evaluations", "1", "--error", "1e-12", "-o", str(tmp_path))
    result = CliRunner().invoke(cli, ("gains", "tune", "--sensors", sensors, *words))
    assert isinstance(result.exception, InputError)
    assert "law ctc: no gains are as asked" in str(result.exception)
    assert not [*tmp_path.iterdir()]
