"""The command ``space-robot campaign report``."""

from __future__ import annotations

from pathlib import Path

import click

from .options import file_option


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@file_option("--html", help="One page with all tables and figures, to send to a colleague.")
@file_option(
    "--markdown", help="The tables as Markdown, and a figure of the same name as PNG and SVG."
)
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    metavar="NAME",
    help="Compare the laws by this metric, as attitude.max; repeatable [default: RMS errors, "
    "the base's ripple, and what is required].",
)
@click.option(
    "--study",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Judge by the requirements of this campaign's file [default: those that were flown].",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def report(
    folder: Path,
    html: Path | None,
    markdown: Path | None,
    metrics: tuple[str, ...],
    study: Path | None,
    as_json: bool,
) -> None:
    """Report a campaign: limits met, requirements, laws, influences, worst runs.

    DIR is the folder of `campaign run`, finished or not. docs/manual/campaigns.md explains
    the numbers. Damaged files are listed.

    \b
    Examples:
      space-robot campaign report campaigns/a
      space-robot campaign report campaigns/a --html a.html
      space-robot campaign report campaigns/a --metric attitude.max --json
      space-robot campaign report campaigns/a --study stricter.yaml
    """
    from ..analysis.figures.style import save_figure
    from ..campaign.flown import FlownCampaign
    from ..campaign.report import documents
    from ..campaign.report.figures import summary_figure
    from ..campaign.report.findings import Findings
    from ..campaign.study import read_study
    from ..console.files import check_free, write_text
    from ..console.terminal import echo_json, terminal

    for path in (html, markdown):
        if path:
            check_free(path)
    judged_by = None if study is None else read_study(study)
    findings = Findings.of(FlownCampaign.open(folder), judged_by, metrics)
    for warning in findings.warnings:
        click.echo(warning, err=True)
    if html:
        write_text(documents.render(findings), html)
        click.echo(f"wrote {html}", err=True)
    if markdown:
        files = [markdown]
        if figure := summary_figure(findings):
            files += save_figure(figure, markdown.with_suffix(""))
        write_text(documents.markdown(findings), markdown)
        click.echo(f"wrote {', '.join(map(str, files))}", err=True)
    if as_json:
        echo_json(documents.record(findings))
    else:
        documents.print_report(findings, terminal())
