"""The commands ``space-robot help`` and ``completion``."""

from __future__ import annotations

from pathlib import Path

import click

FOLDER = Path(__file__).parents[1] / "help"
"""With a Markdown file for each topic."""
ORDER = (
    "first-flight",
    "results",
    "own-robot",
    "own-trajectory",
    "own-law",
    "gains",
    "sensors",
    "disturbances",
    "campaign",
    "ros",
    "realtime",
    "install",
)
"""The topics as they are listed: a new user's path."""
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


@click.command()
@click.argument("topic", default="")
@click.pass_context
def help(context: click.Context, topic: str) -> None:
    """Show the answer to a question of new users, with commands to try; without TOPIC, list all.

    TOPIC may also be a command, whose --help is shown.

    \b
    Examples:
      space-robot help
      space-robot help own-robot
      space-robot help simulate
    """
    group = context.find_root().command
    command = group.get_command(context, topic) if isinstance(group, click.Group) else None
    if not topic:
        width = max(map(len, ORDER))
        for name in ORDER:
            click.echo(f"{name:{width}}  {read_topic(name)[0]}")
        click.echo(
            "\nspace-robot help TOPIC shows one of them, space-robot COMMAND --help a command."
        )
    elif command and not command.hidden and topic not in ORDER:
        with click.Context(command, info_name=topic, parent=context.parent) as own:
            click.echo(command.get_help(own))
    else:
        from space_robot_msgs_py.config.validation import one_of

        heading, *lines = read_topic(one_of(topic, ORDER, "topic"))
        click.echo("\n".join([click.style(heading, bold=True), *lines]))


def read_topic(name: str) -> list[str]:
    """Return the lines of a topic: its question, and the answer with indented commands."""
    question, *lines = (FOLDER / f"{name}.md").read_text("utf-8").rstrip().split("\n")
    texts, is_fenced = [question.removeprefix("# ")], False
    for line in lines:
        if line.startswith("```"):
            is_fenced = not is_fenced
        else:
            texts.append(f"    {line}" if is_fenced and line else line)
    return texts
