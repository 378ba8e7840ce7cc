"""Evidence of requirements: flown, computed or run, once for all that share it."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple, get_args

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError, SpaceRobotError
from space_robot_msgs_py.ros.process import module_command

from ..analysis.measure import measure
from ..api import Scenario
from ..api.flown_flight import fly_in_process
from ..campaign.flown import Campaign
from ..campaign.flown.manifest import ROOT, digest, flight_digest
from ..campaign.row.measure import check_requirements
from ..campaign.row.row import Row, Task
from ..campaign.study import Condition, read_study
from ..flight.compilation import compile_kernels
from ..processes.executor import run_many
from .requirements import AnalysisEvidence, CampaignEvidence, FlightEvidence, TracedRequirement

EvidenceVerdict = Literal["violated", "not verified", "open", "verified"]
GRAVEST_FIRST: tuple[EvidenceVerdict, ...] = get_args(EvidenceVerdict)
"""The gravest first, which counts where a requirement has several numbers."""
DECIDED: dict[str, EvidenceVerdict] = {"met": "verified", "not met": "violated"}
"""By the word of a campaign's verdict; others leave a requirement open."""


class Evidence(NamedTuple):
    """The evidence of a requirement."""

    verdict: EvidenceVerdict
    measured: Sequence[float | None] = ()
    """None: a number is missing."""
    limits: Sequence[str] = ()
    digest: str = ""
    """Of a flight's end, of all rows of a campaign, or of the scenario of exported code."""
    confidence: float | None = None
    remark: str = ""


def gather_evidence(
    requirements: Mapping[str, TracedRequirement],
    where: str,
    workers: int,
    progress: Callable[[int], Callable[[], None]],
) -> dict[str, Evidence]:
    """Return the evidence of each requirement, by identifier; ``where`` names their file.

    ``progress``: called with the number of pieces, gives what is called after each.

    Raises:
        InputError: a scenario, metric, study or test does not exist; before anything is flown.
    """
    shared: dict[tuple[str, ...], list[str]] = {}
    for id_, requirement in requirements.items():
        method, own = requirement.evidence
        try:
            shared.setdefault((method, *_key(own)), []).append(id_)
        except InputError as error:
            raise InputError(f"{where}: requirements.{id_}.{method}: {error}") from None
    compile_kernels()  # else each process would
    items = [(k[0], ids, [requirements[i].evidence[1] for i in ids]) for k, ids in shared.items()]
    evidence, count = dict[str, Evidence](), progress(len(items))
    # a worker that is killed would leave the processes of tests and commands behind
    here = [item for item in items if item[0] in ("test", "analysis")]
    others = [item for item in items if item not in here]
    with closing(run_many(_gather_shared, others, workers=workers)) as running:
        for done in chain(running, run_many(_gather_shared, here, workers=0)):
            evidence.update(zip(done.item[1], done.value(), strict=True))
            count()
    return {id_: evidence[id_] for id_ in requirements}


def _key(evidence: Any) -> tuple[str, ...]:
    """Check that evidence can be gathered; return what is the same for all that share it."""
    if isinstance(evidence, CampaignEvidence):
        study = read_study(evidence.study)
        one_of(evidence.requirement, study.require, "requirement", f" of {study.where}")
        one_of(evidence.law or study.laws[0], study.laws, "law", f" of {study.where}")
        return study.where, str(evidence.runs), str(evidence.seed)
    if isinstance(evidence, FlightEvidence):
        flight = Scenario(**evidence.scenario).check()
        check_requirements(flight, {str(k): c for k, c in enumerate(evidence.require)}, "require")
        return (flight_digest(flight),)
    if isinstance(evidence, str) and (ROOT / "tests").is_dir():
        file, *_, node = evidence.split("::")
        text = (ROOT / file).read_text("utf-8") if (ROOT / file).is_file() else ""
        if f"def {node.partition('[')[0]}(" not in text:
            raise InputError(f"there is no test {evidence}")
    return (str(getattr(evidence, "command", evidence)),)


def _gather_shared(item: tuple[str, list[str], Sequence[Any]]) -> list[Evidence]:
    method, _, pieces = item
    try:
        return list(GATHER[method](pieces))
    except SpaceRobotError as error:
        return [Evidence("not verified", remark=str(error)) for _ in pieces]


def _fly(pieces: Sequence[FlightEvidence]) -> Iterator[Evidence]:
    flown = fly_in_process(Scenario(**pieces[0].scenario).check())
    row = Row(Task(0, ""), flown.outcome, flown.reason, flown.ended_at_s)
    end = row.digested(flown.flight.plant.truth.block.tobytes()).digest
    for piece in pieces:
        if flown.is_complete:
            numbers = (measure(flown.log, [c.metric], c.window) for c in piece.require)
            values = [own.get(c.metric) for c, own in zip(piece.require, numbers, strict=True)]
            yield _judge(piece.require, values, end)
        else:
            yield Evidence("violated", digest=end, remark=flown.reason)


def _judge(
    conditions: Sequence[Condition], values: Sequence[float | None], digest: str
) -> Evidence:
    verdicts: list[EvidenceVerdict] = [
        "not verified" if value is None else "verified" if c.is_met(value) else "violated"
        for c, value in zip(conditions, values, strict=True)
    ]
    return Evidence(min(verdicts, key=GRAVEST_FIRST.index), values, [*map(str, conditions)], digest)


def _fly_campaign(pieces: Sequence[CampaignEvidence]) -> Iterator[Evidence]:
    campaign = Campaign.load(pieces[0].study)
    flown = campaign.run(pieces[0].runs, pieces[0].seed, workers=0, warn=lambda _: None)
    rows = digest("".join(flown.table["digest"]).encode())
    for piece in pieces:
        demand = flown.study.require[piece.requirement]
        all_laws = (v for v in flown.verdicts if v.requirement == piece.requirement)
        verdicts = [v for v in all_laws if piece.law in (None, v.law)]
        verdict = min((DECIDED.get(v.word, "open") for v in verdicts), key=GRAVEST_FIRST.index)
        counts = (f"{v.law} {v.point}".rstrip() + f": met in {v.met} of {v.runs}" for v in verdicts)
        bounds, remark = [v.bound for v in verdicts], "; ".join(counts)
        yield Evidence(verdict, bounds, [str(demand)], rows, demand.confidence, remark)


def _test(pieces: Sequence[str]) -> Iterator[Evidence]:
    options = ("--no-header", "-p", "no:cacheprovider")
    code, output, remark = _run("pytest", *options, pieces[0], cwd=ROOT)
    counts = {word: float(n) for n, word in re.findall(r"(\d+) (passed|failed|error|skip)", output)}
    verdict: EvidenceVerdict = "violated" if code == 1 and counts else "not verified"
    if code == 0 and counts.keys() == {"passed"}:
        verdict, remark = "verified", ""
    passed = Evidence(verdict, [counts.get("passed")], ["all tests pass"], remark=remark)
    return (passed for _ in pieces)


def _analyse(pieces: Sequence[AnalysisEvidence]) -> Iterator[Evidence]:
    with TemporaryDirectory() as scratch:
        words = shlex.split(pieces[0].command.replace("{scratch}", scratch))
        code, output, remark = _run("space_robot", *words[1:])
    if code not in (0, 1) or not output:
        raise SpaceRobotError(remark)
    report = json.loads(output)
    numbers = dict(_numbers(report))
    own = str(report.get("digest", "")) if isinstance(report, dict) else ""
    for piece in pieces:
        judged = _judge(piece.require, [numbers.get(c.metric) for c in piece.require], own)
        missing = (f"no number {c.metric}" for c in piece.require if c.metric not in numbers)
        failed = judged._replace(verdict="violated", remark=remark)
        yield failed if code else judged._replace(remark="; ".join(missing))


def _numbers(tree: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield path and value of each number; true counts as 1, an item of a list by its place."""
    if isinstance(tree, (dict, list)):
        for key, inner in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from _numbers(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(tree, (int, float)):
        yield path, float(tree)


def _run(*words: str, cwd: Path | None = None) -> tuple[int, str, str]:
    """Return exit code, output and last line, errors included, of a module of Python."""
    command, pipe, nothing = module_command(*words), subprocess.PIPE, subprocess.DEVNULL
    run = subprocess.run(command, cwd=cwd, stdin=nothing, stdout=pipe, stderr=pipe, text=True)
    return run.returncode, run.stdout, (run.stdout + run.stderr).strip().rpartition("\n")[2]


GATHER: dict[str, Callable[[Sequence[Any]], Iterator[Evidence]]] = {
    **{"flight": _fly, "campaign": _fly_campaign, "test": _test, "analysis": _analyse},
    "inspection": lambda pieces: (Evidence("verified", remark=p.words) for p in pieces),
}
"""How evidence is gathered, by the method."""
