"""Flights under attack, one after the other: ``python tests/hostile --help``."""

from __future__ import annotations

import sys
from pathlib import Path

import click

sys.path.insert(0, str(Path(__file__).resolve().parent))

from attacks import GROUPS
from trial import Verdict

from space_robot.flight.graph.domain import ros_domain


@click.command()
@click.argument("groups", nargs=-1, type=click.Choice(list(GROUPS)))
@click.option("--only", default="", metavar="TEXT", help="Attacks whose name holds TEXT.")
@click.option("--every", type=click.IntRange(1), default=1, help="Only every so many-th attack.")
@click.option("--list", "as_list", is_flag=True, help="Name the attacks, carry out none.")
def hostile(groups: tuple[str, ...], only: str, every: int, as_list: bool) -> None:
    r"""Attack flights on the real graph and see that none is harmed without a word.

    After each: the flight is over, with a report or with its reason in one line; its bag is closed
    and every row of it whole; no process is left; and the domain can be flown in again. Exit
    code 1: that was not so somewhere. All of it takes half an hour or more.

    \b
    Examples:
      python tests/hostile
      python tests/hostile deaths --only recorder
      python tests/hostile foreign --every 5
    """
    chosen = [
        (name, attack)
        for group in groups or tuple(GROUPS)
        for name, attack in list(GROUPS[group]())
        if only in name
    ][::every]
    if as_list:
        click.echo("\n".join(name for name, _ in chosen))
        return
    harmed = 0
    for _, attack in chosen:
        with ros_domain() as domain:
            pass  # a free one, for the flight to take
        for verdict in attack(domain):
            harmed += bool(verdict.wrong)
            _show(verdict)
    click.echo(f"{len(chosen)} attacks, {harmed} flights harmed")
    sys.exit(harmed > 0)


def _show(verdict: Verdict) -> None:
    mark = "HARMED" if verdict.wrong else "ok"
    click.echo(f"{mark:6} {verdict.seconds:5.1f} s, {verdict.exit_code}: {verdict.name}")
    for text in (verdict.said, *verdict.wrong):
        if text:
            click.echo(f"       {text}")


if __name__ == "__main__":
    hostile()
