"""Python interface of campaigns.

campaign = Campaign.load("my.yaml").run(runs=10_000, seed=7, out="campaigns/a")
campaign.table, campaign.verdicts, campaign.rerun(4711).log
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from space_robot_msgs_py.config.arguments import as_path, as_positive, as_whole_number
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import short, validate
from space_robot_msgs_py.config.yaml_text import read_file
from space_robot_msgs_py.errors import InputError

from ...analysis.own_metric import SESSION, MetricFunction, check_names, importable_text
from ...console.progress import check_progress, rated_progress
from ...processes.executor import connected, cores, is_daemonic, start_fork_server
from ...processes.scratch_folder import ScratchFolder
from ..study import Study, read_study
from .flights import Flights, Progress, fly_bags
from .flown_campaign import FlownCampaign
from .preparation import Preparation
from .store import DATABASE, begin_or_resume, held_store


class Campaign:
    """A campaign: each random variation of a study, flown with each of its laws."""

    def __init__(
        self, study: Study, metrics: Mapping[str, MetricFunction | str] | None = None
    ) -> None:
        """Store a study; `run` resolves the files and laws that it names.

        Args:
            study: content of a campaign's file.
            metrics: functions of the log of a flight, by the name of the metric that each returns,
                or their names as in a file; in addition to those of the study.

        Raises:
            InputError: ``study`` is not a `Study`, or a metric is no function.
        """
        if not isinstance(study, Study):
            raise InputError(
                f"study: a Study was expected, got {short(study)}; "
                "Campaign.load reads a file, Campaign.of a mapping"
            )
        self.study = _with_metrics(study, metrics or {})
        self._text = ""

    @classmethod
    def load(
        cls, path: str | Path, metrics: Mapping[str, MetricFunction | str] | None = None
    ) -> Campaign:
        """Read a campaign's file, by its path or by a name of ``config/campaigns``.

        ``metrics``: in addition to those of the file, see `Campaign`.

        Raises:
            InputError: in one line, naming file and key.
        """
        campaign = cls(read_study(path), metrics)
        if not metrics:
            campaign._text = read_file(Path(campaign.study.where))
        return campaign

    @classmethod
    def of(
        cls, content: Mapping[str, Any], metrics: Mapping[str, MetricFunction | str] | None = None
    ) -> Campaign:
        """Build a campaign from the content of a file: ``{"laws": ["ctc"], "vary": {...}}``.

        ``metrics``: in addition to those of the content, see `Campaign`.

        Raises:
            InputError: in one line, naming the key.
        """
        plain = dict(content) if isinstance(content, Mapping) else content
        return cls(validate(Study, plain, "campaign"), metrics)

    def run(
        self,
        runs: int | None = None,
        seed: int = 0,
        out: str | Path | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        timeout_s: float | None = None,
        device: str = "cpu",
        progress: Callable[[Progress], object] | bool | None = None,
        warn: Callable[[str], object] = warnings.warn,
    ) -> FlownCampaign:
        """Fly the campaign, or its remaining flights.

        The table depends only on file, seed, runs and software, not on the number of workers or on
        interruptions. After Ctrl-C (KeyboardInterrupt) it contains the completed flights.

        Args:
            runs: number of draws, each flown with every law; None: from the file.
            seed: of all draws.
            out: the campaign's folder; an existing campaign is resumed. None: a temporary folder,
                deleted with the returned object.
            workers: number of processes; 0: this process; None: one per processor.
            scheduler: address of a Dask scheduler whose workers fly instead.
            timeout_s: longest wall-clock time of a flight; its outcome is then ``out_of_time``.
                With such a limit flights are flown one by one, not eight at a time.
            device: ``gpu``: flights that share a batch fly on an NVIDIA device, with the same rows.
            progress: called at the beginning and after each group of up to eight flights; True: a
                progress line, in a terminal or a notebook.
            warn: called with a line if the folder's copy of the study was changed, and for each
                law whose flights are flown one by one.

        Raises:
            InputError: something cannot be flown; the folder is another campaign's; disk full; a
                metric's function fails, or cannot be sent to the workers or kept in a folder.
        """
        try:
            import pandas  # noqa: F401
        except ImportError:
            command = install_command("campaign")
            raise InputError(f"a campaign's table needs pandas: {command}") from None
        check_progress(progress)
        if local := [n for n, text in self.study.metrics.items() if text.startswith(SESSION)]:
            _check_local(local, out, workers, scheduler)
            workers = 0
            warn(f"metrics {', '.join(local)}: {SESSION_ONLY}: this process flies alone")
        prepared = Preparation.of(self.study, seed, runs, device)
        usual = 0 if is_daemonic() else cores()
        processes = usual if workers is None else as_whole_number(workers, "workers", 0)
        if timeout_s is not None:
            as_positive(timeout_s, "timeout_s")
            if device == "gpu":
                raise InputError("a time limit is of single flights, which fly on the cpu")
            if not processes and scheduler is None:
                raise InputError(
                    "a time limit needs a worker process, which can be ended: 1 or more"
                )
        if processes and scheduler is None:
            start_fork_server()
        manifest = prepared.manifest
        temporary = None if out is not None else ScratchFolder()
        folder = Path(temporary.name) if temporary else as_path(out, "out")
        if not (folder / DATABASE).exists():  # before the folder is created
            if scheduler is not None:
                with connected(scheduler):
                    pass
            if self.study.metrics:
                prepared.compile(is_in_lanes=timeout_s is None)
                prepared.try_metrics(processes, timeout_s if processes else None)
        with held_store(folder) as store:
            if changes := begin_or_resume(store, manifest, self._text or _as_yaml(self.study)):
                warn(changes)
            flights = Flights(prepared.flyer, prepared.runs, store)
            if not flights.are_complete:
                for line in prepared.notes:
                    warn(line)
                prepared.compile(is_in_lanes=timeout_s is None)
                with _shown(progress) as show:
                    flights.fly(show, processes, scheduler, timeout_s)
            stop = flights.precision.stop
            rows = (row for row in store.rows() if row.task.run < stop)
            fly_bags(folder, prepared.flyer, rows, processes)
        return FlownCampaign(folder, True, temporary, flights.kept)

    def _repr_html_(self) -> str:
        study = self.study
        runs = study.runs or (study.until and study.until.runs)
        flights = f", {runs} runs, {runs * len(study.laws)} flights" if runs else ""
        caption = f"{study.where}: {', '.join(study.laws)}{flights}"
        demands = {name: str(demand) for name, demand in study.require.items()}
        return (
            html_table(("option", "value"), _pairs(study.scenario), caption)
            + html_table(("variable", "distribution"), _pairs(study.vary))
            + html_table(("requirement", "demand"), _pairs(demands))
        )


@contextmanager
def _shown(
    progress: Callable[[Progress], object] | bool | None,
) -> Iterator[Callable[[Progress], object]]:
    if progress is not True:
        yield progress or (lambda _: None)
        return
    with rated_progress("flights") as show:
        yield lambda p: show(p.done, p.total, f"{p.failed} failed" if p.failed else "")


SESSION_ONLY = "of this Python session (a notebook's or script's function, or a lambda)"


def _check_local(
    names: Sequence[str], out: str | Path | None, workers: int | None, scheduler: str | None
) -> None:
    if workers or scheduler is not None or out is not None:
        option = "out" if out is not None else "scheduler" if scheduler is not None else "workers"
        raise InputError(
            f"{option}: metrics {', '.join(names)} are {SESSION_ONLY}, which no other process can "
            f"import: put them into a file, mine.py, and name them as 'mine.py:{names[0]}', or "
            "leave out, workers and scheduler away"
        )


def _with_metrics(study: Study, metrics: Mapping[str, MetricFunction | str]) -> Study:
    for name, function in metrics.items():
        if name in study.metrics:
            raise InputError(f"{study.where}: metrics: {name} is defined twice")
        check_names([name])
        study = study.model_copy(
            update={"metrics": {**study.metrics, name: importable_text(function)}}
        )
    return study


def _as_yaml(study: Study) -> str:
    content = study.model_dump(by_alias=True, exclude_defaults=True)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def _pairs(content: Mapping[str, Any]) -> Iterator[list[str]]:
    for name, value in content.items():
        text = yaml.safe_dump(value, default_flow_style=True, width=10**9, allow_unicode=True)
        yield [name, value if isinstance(value, str) else text.partition("\n")[0]]
