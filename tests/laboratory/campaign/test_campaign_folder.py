"""A campaign's folder: rows and manifest; what somebody has changed in it is told."""

from __future__ import annotations

import multiprocessing
import shutil
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from space_robot.campaign.flown import Campaign, FlownCampaign
from space_robot.campaign.flown.manifest import Columns, Manifest, file_digests, source_digest
from space_robot.campaign.flown.store import begin_or_resume, held_store
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Study
from space_robot_control.laws.names import NotTrustedError
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")

CONTENT: dict[str, Any] = {
    "scenario": {"case": "3", "duration": 0.01},
    "laws": ["tde_stc", "ctc"],
    "vary": {"robot.links[*].mass": {"normal": 1.0, "sigma": 0.05, "relative": True}},
    "require": {
        "pointing": {"metric": "attitude.max", "below": 1e-9, "in": 0.9},
        "late": {"metric": "attitude.rms", "from_s": 0.005, "below": 1.0, "in": 0.9},
    },
}

CAMPAIGN = Campaign.of(CONTENT)


def numbers(folder: Path, study: Study | None = None) -> tuple[str, list[str]]:
    """All that a report is made of, and its remarks on the folder."""
    found = Findings.of(FlownCampaign.open(folder), study)
    text = f"{found.table.to_dict('list')} {found.verdicts} {found.seed} {found.runs} {found.about}"
    return text, list(found.warnings)


def run(folder: Path, warn: Callable[[str], object] = warnings.warn) -> FlownCampaign:
    return CAMPAIGN.run(2, 7, folder, workers=0, warn=warn)


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


def test_the_study_that_was_flown_counts(copy: Path, reported: str) -> None:
    text = (copy / "study.yaml").read_text()
    (copy / "study.yaml").write_text(text.replace("1.0e-09", "1.0"))
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
        "by_rms": {"metric": "attitude.rms", "below": 1.0, "in": 0.5},
        "late_again": {**CONTENT["require"]["late"], "below": 1e-30},
    }
    found = Findings.of(FlownCampaign.open(whole), asked(require=require, runs=9))
    assert found.table["require.by_rms"].equals(table["metric.attitude.rms"])
    assert found.table["require.late_again"].equals(table["require.late"])
    assert "require.pointing" not in found.table
    failures = {v.requirement: v.failures for v in found.verdicts}
    assert failures == {"by_rms": 0, "late_again": 2}
    assert found.warnings == ["The requirements are those of other.yaml."]
    assert numbers(whole)[0] == reported
    for other, said in (
        ({"laws": ["ctc"]}, "other.yaml: laws: .* was flown"),
        ({"scenario": {"case": "1", "duration": 0.01}}, "scenario.case: '3' was flown, not '1'"),
        (
            {"require": {"p": {**CONTENT["require"]["late"], "from_s": 0.006}}},
            r"other.yaml: require.p: the rows have no attitude.rms in that window",
        ),
    ):
        with pytest.raises(InputError, match=said):
            Findings.of(FlownCampaign.open(whole), asked(**other))


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
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "law_of_somebody.py").write_text(LAW)
    monkeypatch.syspath_prepend(tmp_path)
    law, target = "law_of_somebody:Free", f"capture@0.001:{tmp_path}/target.yaml"
    in_parameters = {"parameters": {"controller": {"controller": law}}}
    others: tuple[dict[str, Any], ...] = (
        {"laws": ["ctc", law]},
        {"laws": ["ctc"], "scenario": {"duration": 0.01, **in_parameters}},
        {"laws": [f"ctc={tmp_path}/gains"]},
        {"vary": {"scenario.case": {"choice": ["1", str(tmp_path / "case.yaml")]}}},
        {"scenario": {"duration": 0.01, "events": [target]}},
    )
    for number, other in enumerate(others):
        folder = Path(shutil.copytree(whole, tmp_path / str(number)))
        study = Study.model_validate({**CONTENT, "require": {}, **other})
        changed = FlownCampaign.open(whole).manifest.model_copy(update={"study": study.content})
        with held_store(folder) as store:
            store.write_manifest(changed)
        with pytest.raises(NotTrustedError, match=r"only with --trust|--trust imports a"):
            FlownCampaign.open(folder).rerun(0)
    assert "law_of_somebody" not in sys.modules
    mine = Campaign.of({**CONTENT, "require": {}, "laws": [law]})
    flown = mine.run(1, 7, tmp_path / "mine", workers=0)
    assert flown.rerun(0).is_same
    with pytest.raises(NotTrustedError, match="the campaign uses the law"):
        FlownCampaign.open(tmp_path / "mine").rerun(0)
    assert FlownCampaign.open(tmp_path / "mine", trust=True).rerun(0).is_same


BOTH = ["tde_stc", "ctc=tuned"]

COLUMNS = Columns(
    grid={}, vary={"mass": "float64", "word": "str"}, metrics=["m"], require=["r"], bands=["s"]
)


def test_any_change_of_any_source_changes_the_digest_of_the_software(tmp_path: Path) -> None:
    digests = [source_digest(tmp_path)]
    rooms = ("space_robot_msgs_py", "space_robot_model", "space_robot_sim/deep")
    for room in (*rooms, "space_robot_control", "space_robot"):
        for content in (b"", b"x"):
            file = tmp_path / room / "one.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
            digests.append(source_digest(tmp_path))
    file.rename(file.with_name("two.py"))
    assert len({*digests, source_digest(tmp_path)}) == 12


@given(st.lists(st.floats(), max_size=3), st.lists(st.floats(width=32), max_size=3))
def test_every_bit_comes_back(values: list[float], sizes: list[float]) -> None:
    metrics, band = dict(zip("abc", values, strict=False)), np.array(sizes, np.float32)
    row = Row(Task(3, "ctc"), "complete", metrics=metrics, bands={"b": band, "c": band[1:]})
    with TemporaryDirectory() as folder, held_store(Path(folder)) as store:
        store.add(row)
        (stored,) = store.rows()
    assert repr(stored.metrics) == repr(metrics)
    assert [b.tobytes() for b in stored.bands.values()] == [band.tobytes(), band[1:].tobytes()]


@pytest.mark.parametrize("is_cut", [False, True])
def test_damage_is_told_in_a_line(copy: Path, is_cut: bool) -> None:
    file = copy / "campaign.sqlite"
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2] if is_cut else b"x" * 100 + data[100:])
    with pytest.raises(InputError, match=r"campaign\.sqlite: damaged: [^\n]+$"):
        assert len(FlownCampaign.open(copy).table)


def test_an_export_has_every_number(whole: Path, tmp_path: Path) -> None:
    flown = FlownCampaign.open(whole)
    flown.export(tmp_path / "table.csv")
    flown.export(tmp_path / "table.parquet")
    again = pandas.read_csv(tmp_path / "table.csv", float_precision="round_trip")
    assert again["metric.attitude.max"].equals(flown.table["metric.attitude.max"])
    again = pandas.read_parquet(tmp_path / "table.parquet")
    assert (again["band.attitude"][0] == flown.table["band.attitude"][0]).all()


def content_of(study: dict[str, object]) -> dict[str, object]:
    return Study.model_validate(study).content


def manifest(**other: object) -> Manifest:
    content = {
        "seed": 7,
        "runs": 20,
        "study": content_of({"laws": BOTH, "vary": {"a": {"normal": 1.0}}}),
        "software": {"numpy": "2.0"},
        "commit": None,
        "files": {},
        "flights": {"tde_stc": "f"},
        "table": COLUMNS.model_dump(),
    }
    return Manifest.model_validate({**content, **other})


LATIN = {"study": content_of({"laws": BOTH, "design": "latin_hypercube"})}
FIXED = {"study": content_of({"laws": BOTH, "fixed_runs": True})}


@pytest.mark.parametrize(
    ("first", "other", "said"),
    [
        ({}, {"seed": 8}, "another seed: 7 then, 8 now"),
        ({}, {"software": {"numpy": "2.1"}}, "another software: numpy: '2.0' then, '2.1' now"),
        (
            {},
            {"study": content_of({"laws": BOTH, "vary": {"a": {"normal": 2.0}}})},
            "another file: vary.a.normal: 1.0 then, 2.0 now",
        ),
        ({}, {"files": {"my.yaml": "f"}}, "another named file: my.yaml: None then, 'f' now"),
        ({}, {"runs": 19}, "started with 20 runs, 19 are requested: request 20 or more"),
        (LATIN, {**LATIN, "runs": 40}, "latin_hypercube design cannot be extended"),
        (FIXED, {**FIXED, "runs": 40}, "its file has fixed_runs: true"),
    ],
)
def test_another_campaign_is_refused_in_a_line(
    tmp_path: Path, first: dict[str, object], other: dict[str, object], said: str
) -> None:
    folder, begun = tmp_path / "a", manifest(**first)
    with held_store(folder) as store:
        for _ in range(2):
            assert not begin_or_resume(store, begun, yaml.safe_dump(begun.study))
        with pytest.raises(InputError) as refused:
            begin_or_resume(store, manifest(**other), "")
        assert store.manifest == begun
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_one_process_at_a_time(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()

    def hold() -> None:
        try:
            with held_store(tmp_path):
                theirs.send("held")
        except InputError as error:
            theirs.send(str(error))

    with held_store(tmp_path):
        context.Process(target=hold).start()
        assert "another process is flying this campaign" in ours.recv()
    context.Process(target=hold).start()
    assert ours.recv() == "held"


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    said = r"contains thesis\.tex and no "
    with pytest.raises(InputError, match=said), held_store(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_of_the_names_in_a_file_those_of_settings_and_laws_are_digested(tmp_path: Path) -> None:
    """Not a folder, and not a file of another kind that a text happens to name."""
    settings_file, law, other = (tmp_path / name for name in ("a.yaml", "law.py", "notes.txt"))
    for file in (settings_file, law, other):
        file.write_text(file.name)
    (tmp_path / "folder.yaml").mkdir()
    names = [str(settings_file), f"{law}:Law", str(other), str(tmp_path / "folder.yaml"), "b.yaml"]
    found = file_digests({"values": names})
    assert set(found) == {str(settings_file), str(law)}
    assert found[str(settings_file)] != found[str(law)]
