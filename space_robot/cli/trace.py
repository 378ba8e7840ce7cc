"""The command ``space-robot trace``: verify requirements, and write the matrix of evidence."""

from __future__ import annotations

from pathlib import Path

import click

from .option_types import names_in
from .options import WORKERS, flight_option, folder_option


@click.command()
@click.argument("file", default="paper", shell_complete=names_in("requirements"))
@click.option("--only", metavar="ID,...", help="Requirements to take [default: all].")
@click.option("--list", "is_listed", is_flag=True, help="List them without verifying.")
@folder_option("--out", help="New folder for the matrix as Markdown, HTML and JSON.")
@WORKERS
@flight_option("json")
def trace(
    file: str, only: str, is_listed: bool, out: Path | None, workers: int | None, as_json: bool
) -> None:
    """Verify requirements by flights, campaigns, tests and analyses.

    FILE is a YAML file, or a name of config/requirements [default: paper];
    docs/manual/requirements.md has its format. The commands and tests in it are run. Exit code 1 if
    a requirement is violated.

    \b
    Examples:
      space-robot trace
      space-robot trace --only PNT-001,PNT-002 --json
      space-robot trace mine.yaml --out matrix
    """
    from space_robot_msgs_py.config.validation import one_of

    from ..console.files import check_free
    from ..console.progress import counting_progress
    from ..console.tables import Table, named
    from ..console.terminal import echo_json, print_table, terminal
    from ..processes.executor import cores
    from ..trace.evidence import gather_evidence
    from ..trace.matrix import matrix_record, matrix_table, write_matrix
    from ..trace.requirements import read_requirements

    content = read_requirements(file)
    chosen = content.requirements
    if only:
        ids = {one_of(id_, chosen, "requirement", " of --only") for id_ in only.split(",")}
        chosen = {id_: requirement for id_, requirement in chosen.items() if id_ in ids}
    if is_listed:
        columns = [named(name) for name in ("id", "text", "method", "source")]
        rows = [[id_, r.text, r.evidence[0], r.source] for id_, r in chosen.items()]
        print_table(Table.of(content.title, columns, rows), terminal())
        return
    if out:
        check_free(out)
    with counting_progress("evidence") as begin:
        evidence = gather_evidence(chosen, file, cores() if workers is None else workers, begin)
    record = matrix_record(file, content, evidence)
    if out:
        write_matrix(record, out)
        click.echo(f"wrote {out}", err=True)
    if as_json:
        echo_json(record)
    else:
        print_table(matrix_table(record, is_brief=True), terminal())
    if any(each.verdict == "violated" for each in evidence.values()):
        raise click.exceptions.Exit(1)
