"""The command ``space-robot completion``: print the completion script of a shell."""

from __future__ import annotations

import click

SECTION = "Begin"

PROGRAM = "space-robot"
VARIABLE = "_SPACE_ROBOT_COMPLETE"
"""Environment variable with which the script asks for completions, as click names it."""


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the script that lets a shell complete commands, options and names.

    Names of laws, cases, robots, missions and campaigns are completed, too, and files where an
    option takes a path. The last line of the examples is for the running terminal only.

    \b
    Examples:
      space-robot completion bash >> ~/.bashrc
      space-robot completion zsh >> ~/.zshrc         after the line with compinit
      space-robot completion fish > ~/.config/fish/completions/space-robot.fish
      eval "$(space-robot completion bash)"
    """
    from click.shell_completion import get_completion_class

    root = click.get_current_context().find_root().command
    kind = get_completion_class(shell)
    assert kind is not None  # click has these three
    click.echo(kind(root, {}, PROGRAM, VARIABLE).source())
