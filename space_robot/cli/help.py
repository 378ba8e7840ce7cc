"""The command ``space-robot help``: short answers to the questions of new users."""

from __future__ import annotations

import click

SECTION = "Begin"


@click.command()
@click.argument("topic", default="")
def help(topic: str) -> None:
    """Show the answer to a question of new users, with commands to try; without TOPIC, list all.

    TOPIC may also be a command, whose --help is shown.

    \b
    Examples:
      space-robot help
      space-robot help own-robot
      space-robot help simulate
    """
    from ..help.topics import ORDER, as_plain_text, read_topic, title

    context = click.get_current_context()
    commands = _commands(context)
    if not topic:
        width = max(map(len, ORDER))
        for name in ORDER:
            click.echo(f"{name:{width}}  {title(read_topic(name))}")
        click.echo(
            "\nspace-robot help TOPIC shows one of them, space-robot COMMAND --help a command."
        )
    elif topic in commands and topic not in ORDER:
        command = commands[topic]
        with click.Context(command, info_name=topic, parent=context.parent) as own:
            click.echo(command.get_help(own))
    else:
        heading, _, rest = as_plain_text(read_topic(topic)).partition("\n")
        click.echo(f"{click.style(heading, bold=True)}\n{rest}")


def _commands(context: click.Context) -> dict[str, click.Command]:
    """Return the visible commands by name."""
    group = context.find_root().command
    commands = group.commands if isinstance(group, click.Group) else {}
    return {name: command for name, command in commands.items() if not command.hidden}
