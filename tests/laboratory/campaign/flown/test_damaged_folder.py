"""A campaign's folder that somebody or something has changed: no number changes unnoticed."""

from __future__ import annotations

import json
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.campaign.flown import Campaign, FlownCampaign
from space_robot.campaign.flown.preparation import Preparation
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.report.subject import subject_of
from space_robot.campaign.store.manifest import read_manifest
from space_robot.campaign.study import Study
from space_robot.campaign.verdicts.requirements import verdicts
from space_robot_control.laws.trust import NotTrustedError
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")
CONTENT: dict[str, Any] = {
    "scenario": {"case": "3", "duration": 0.01},
    "laws": ["tde_stc", "ctc"],
    "vary": {"robot.links[*].mass": {"normal": 1.0, "sigma": 0.05, "relative": True}},
    "require": {
        "pointing": {"metric": "attitude_max", "below": 1e-9, "in": 0.9},
        "late": {"metric": "attitude_rms", "from_s": 0.005, "below": 1.0, "in": 0.9},
    },
}
FILES = ("campaign.json", "campaign.yaml", "journal.db", "table.parquet", "table.parquet.sha256")
CAMPAIGN = Campaign.of(CONTENT)


def numbers(folder: Path, study: Study | None = None) -> tuple[str, list[str]]:
    """All that a report is made of, and its remarks on the folder."""
    subject = subject_of(FlownCampaign.open(folder), study)
    judged = verdicts(subject.table, subject.study, subject.runs)
    text = f"{subject.table.to_dict('list')} {judged} {subject.seed} {subject.runs} {subject.about}"
    return text, list(subject.remarks)


def run(folder: Path, warn: Callable[[str], object] = warnings.warn) -> FlownCampaign:
    return CAMPAIGN.run(2, 7, folder, workers=0, warn=warn)


@pytest.fixture(autouse=True, scope="module")
def prepared_once() -> Iterator[None]:
    """What is prepared for a study does not depend on a folder: do it once, to save time."""
    known: dict[tuple[str, int, int | None], Preparation] = {}
    make = Preparation.of

    def prepared(study: Study, seed: int, runs: int | None) -> Preparation:
        key = study.model_dump_json(), seed, runs
        return known.setdefault(key, known.get(key) or make(study, seed, runs))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Preparation, "of", prepared)
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(tmp_path_factory.mktemp("campaigns") / "whole").folder


@pytest.fixture(scope="module")
def reported(whole: Path) -> str:
    found, remarks = numbers(whole)
    assert not remarks
    return found


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "copy"))


@st.composite
def damages(draw: st.DrawFn) -> Callable[[bytes], bytes | None]:
    """A flipped bit, an end or a part that is lost, bytes too many, or no file at all."""
    kind = draw(st.sampled_from(["flip"] * 5 + ["cut", "cut", "blank", "longer", "gone"]))
    place, bit = draw(st.floats(0.0, 1.0, exclude_max=True)), draw(st.integers(0, 7))

    def damage(data: bytes) -> bytes | None:
        k = int(place * len(data))
        match kind:
            case "flip":
                return data[:k] + bytes([data[k] ^ (1 << bit)]) + data[k + 1 :]
            case "cut":
                return data[:k]
            case "blank":
                return data[:k] + bytes(len(data[k : k + 512])) + data[k + 512 :]
            case "longer":
                return data + data[k:]
        return None

    return damage


@settings(max_examples=25)
@given(
    st.sampled_from([(name,) for name in FILES] + [FILES[:1] + FILES[2:3], FILES[2:4]]), damages()
)
def test_nothing_changes_unnoticed_and_run_mends_it(
    whole: Path,
    reported: str,
    tmp_path_factory: pytest.TempPathFactory,
    files: tuple[str, ...],
    damage: Callable[[bytes], bytes | None],
) -> None:
    folder = tmp_path_factory.mktemp("damaged") / "a"
    shutil.copytree(whole, folder)
    for name in files:
        data = damage((folder / name).read_bytes())
        (folder / name).unlink()
        if data is not None:
            (folder / name).write_bytes(data)
    after_report = Path(shutil.copytree(folder, folder.with_name("b")))
    try:
        found, remarks = numbers(after_report)
    except InputError as error:
        found, remarks = "", [str(error)]
    assert remarks or found == reported
    assert not any("\n" in remark for remark in remarks)
    for mended in (folder, after_report):
        lines: list[str] = []
        run(mended, lines.append)
        assert not any("\n" in line for line in lines)
        assert (mended / "table.parquet").read_bytes() == (whole / "table.parquet").read_bytes()
        found, remarks = numbers(mended)
        assert found == reported
        assert not [remark for remark in remarks if "campaign.yaml" not in remark]


def test_a_journal_that_is_gone_costs_no_flight(
    copy: Path, reported: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (copy / "journal.db").unlink()
    found, remarks = numbers(copy)
    assert found == reported
    assert "journal.db: missing; 4 rows are taken from table.parquet" in remarks[0]
    assert run(copy).kept == 4


def test_rows_that_the_table_has_are_not_lost_when_a_run_is_interrupted(copy: Path) -> None:
    (copy / "journal.db").write_bytes(b"")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        CAMPAIGN.run(3, 7, copy, workers=0, progress=interrupt, warn=lambda text: None)
    assert len(FlownCampaign.open(copy).table) == 4


def test_the_table_of_another_campaign_is_none_of_this_one(copy: Path, tmp_path: Path) -> None:
    CAMPAIGN.run(2, 8, tmp_path / "other", workers=0)
    for name in ("table.parquet", "table.parquet.sha256"):
        shutil.copy(tmp_path / "other" / name, copy / name)
    with pytest.raises(InputError, match="of another campaign"):
        _ = FlownCampaign.open(copy).table
    (copy / "journal.db").unlink()
    with pytest.raises(InputError, match=r"no flight has been flown yet; .* missing; 0 rows"):
        numbers(copy)


def test_rows_of_another_campaign_are_never_flown_over(copy: Path) -> None:
    """Without its manifest nothing but the rows say whose the folder is."""
    (copy / "campaign.json").unlink()
    before = {path.name: path.read_bytes() for path in copy.iterdir()}
    with pytest.raises(InputError, match=r"campaign\.json: missing, and no row .* another folder"):
        CAMPAIGN.run(2, 8, copy, workers=0)
    assert {path.name: path.read_bytes() for path in copy.iterdir()} == before


def test_a_folder_of_an_older_version_is_refused_and_left_alone(copy: Path) -> None:
    """Its manifest had neither a digest nor the grid."""
    content = json.loads((copy / "campaign.json").read_text())
    del content["sha256"], content["table"]["grid"]
    (copy / "campaign.json").write_text(json.dumps({**content, "format": 1}))
    before = {path.name: path.read_bytes() for path in copy.iterdir()}
    with pytest.raises(InputError, match=r"campaign\.json: written by version 0\.7 or older"):
        numbers(copy)
    assert {path.name: path.read_bytes() for path in copy.iterdir()} == before


def test_the_study_that_was_flown_counts(copy: Path, reported: str) -> None:
    text = (copy / "campaign.yaml").read_text()
    (copy / "campaign.yaml").write_text(text.replace("1.0e-09", "1.0"))
    found, remarks = numbers(copy)
    assert found == reported
    assert "require.pointing.below: 1e-09 was flown, 1.0 is in the file now" in remarks[0]
    opened = FlownCampaign.open(copy)
    assert [v.word for v in opened.verdicts] == [v.word for v in run(copy).verdicts]


def test_another_study_judges_the_same_rows(whole: Path, reported: str) -> None:
    def asked(**other: Any) -> Study:
        return Study.model_validate({**CONTENT, **other}).named("other.yaml")

    table = FlownCampaign.open(whole).table
    require = {
        "by_rms": {"metric": "attitude_rms", "below": 1.0, "in": 0.5},
        "late_again": {**CONTENT["require"]["late"], "below": 1e-30},
    }
    subject = subject_of(FlownCampaign.open(whole), asked(require=require, runs=9))
    assert subject.table["require.by_rms"].equals(table["metric.attitude_rms"])
    assert subject.table["require.late_again"].equals(table["require.late"])
    assert "require.pointing" not in subject.table
    failures = {v.requirement: v.failures for v in Findings(subject).verdicts}
    assert failures == {"by_rms": 0, "late_again": 2}
    assert subject.remarks == ["The requirements are those of other.yaml."]
    assert numbers(whole)[0] == reported
    for other, said in (
        ({"laws": ["ctc"]}, "other.yaml: laws: .* was flown"),
        ({"scenario": {"case": "1", "duration": 0.01}}, "scenario.case: '3' was flown, not '1'"),
        (
            {"require": {"p": {**CONTENT["require"]["late"], "from_s": 0.006}}},
            r"other.yaml: require.p: the rows have no attitude_rms in that window",
        ),
    ):
        with pytest.raises(InputError, match=said):
            subject_of(FlownCampaign.open(whole), asked(**other))


LAW = """
from typing import ClassVar
from space_robot_control.laws import ControlLaw, LawGains
class Free(ControlLaw):
    name: ClassVar[str] = "free"
    gains_type: ClassVar[type[LawGains]] = LawGains
    def force(self, signals):
        return self.memory.force
"""


def test_a_folder_imports_and_opens_nothing_unless_it_is_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "law_of_somebody.py").write_text(LAW)
    case = tmp_path / "case.yaml"
    monkeypatch.syspath_prepend(tmp_path)
    for number, other in enumerate(
        (
            {"laws": ["ctc", "law_of_somebody:Free"]},
            {
                "laws": ["ctc"],
                "scenario": {
                    "duration": 0.01,
                    "parameters": {"controller": {"controller": "law_of_somebody:Free"}},
                },
            },
            {"laws": [f"ctc={tmp_path}/gains"]},
            {"vary": {"scenario.case": {"choice": ["1", str(case)]}}},
            {"scenario": {"duration": 0.01, "events": [f"capture@0.001:{tmp_path}/target.yaml"]}},
        )
    ):
        folder = tmp_path / str(number)
        folder.mkdir()
        study = Study.model_validate({**CONTENT, "require": {}, **other})
        manifest = read_manifest(_flown_anywhere(tmp_path) / "campaign.json")
        changed = manifest.model_copy(update={"study": study.content})
        changed.write(folder / "campaign.json")
        with pytest.raises(NotTrustedError, match=r"only with --trust|--trust imports a"):
            FlownCampaign.open(folder).rerun(0)
    assert "law_of_somebody" not in sys.modules
    mine = Campaign.of({**CONTENT, "require": {}, "laws": ["law_of_somebody:Free"]})
    flown = mine.run(1, 7, tmp_path / "mine", workers=0)
    assert flown.rerun(0).is_same
    with pytest.raises(NotTrustedError, match="the campaign uses the law"):
        FlownCampaign.open(tmp_path / "mine").rerun(0)
    assert FlownCampaign.open(tmp_path / "mine", trust=True).rerun(0).is_same


def _flown_anywhere(tmp_path: Path) -> Path:
    folder = tmp_path / "shipped"
    if not folder.exists():
        run(folder)
        assert FlownCampaign.open(folder).rerun(1, "ctc").is_same
    return folder
