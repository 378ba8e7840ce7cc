"""The list of commands in the help of ``space-robot``, in sections."""

from __future__ import annotations

import sys

import click

SECTIONS = (
    "Begin",
    "Fly",
    "Robots, missions and own pieces",
    "Results",
    "Gains and studies",
    "Flight code",
)
"""Headings, in order; the module of each command has one of them as ``SECTION``."""
LONGEST_HELP = 200
"""Characters of a command's first sentence, which is wrapped and not cut."""


class SectionedGroup(click.Group):
    """A group whose help lists its commands by `SECTIONS`, each with its first sentence."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each heading that has commands."""
        rows: dict[str, list[tuple[str, str]]] = {heading: [] for heading in SECTIONS}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                rows[section_of(command)].append((name, command.get_short_help_str(LONGEST_HELP)))
        for heading, commands in rows.items():
            if commands:
                with formatter.section(heading):
                    formatter.write_dl(commands)


def section_of(command: click.Command) -> str:
    """Return the heading under which a command is listed."""
    heading: str = vars(sys.modules[command.callback.__module__])["SECTION"]
    return heading
