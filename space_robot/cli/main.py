"""The ``space-robot`` command. Heavy imports wait until a subcommand needs them."""

from __future__ import annotations

import atexit
import gc
import io
import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from typing import NoReturn

import click

from space_robot_msgs_py.config.text import choices, printable
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process import hold_to_standard_input

from ..processes import COLLECTED_AT, MODULES, SUFFIX
from ..processes.interruption import Interrupted, raising_signals

_NO_COMMAND = re.compile(r"No such command '(.*?)'")
_EXTRA = re.compile(r"Got unexpected extra arguments? \((.*)\)")
_NO_NUMBER = re.compile(r"(.*) is not a valid (float|integer)( range)?\.")
_NO_CHOICE = re.compile(r"(.*) is not one of .*\.")
_KINDS = {"float": "a number", "integer": "a whole number"}
_HELP_TOPICS = {"campaign": "campaign", "gains": "gains", "plan": "own-trajectory"}
"""Topics of commands, for errors without a topic of their own."""
SECTIONS = {
    "Begin": ("completion", "doctor", "examples", "help"),
    "Fly": ("fly", "goto", "scenario", "sim", "simulate"),
    "Robots, missions and own pieces": ("new", "plan", "robot", "urdf"),
    "Results": ("analyze", "diff", "replay", "trace", "view"),
    "Gains and studies": ("campaign", "choose", "gains", "reproduce", "stability"),
    "Flight code and ground": ("export", "ground", "telemetry"),
}
"""Headings of the help, and the commands below each."""
SHARED_MODULES = {
    **{"completion": "shell", "help": "shell"},
    **{"fly": "flights", "scenario": "flights", "simulate": "flights"},
    **{"goto": "graph", "sim": "graph"},
    **{"robot": "robots", "urdf": "robots"},
    **{"reproduce": "paper", "stability": "paper"},
}
"""Modules of commands that share one; others have one of their name."""
COMMANDS = {name: SHARED_MODULES.get(name, name) for names in SECTIONS.values() for name in names}
"""Module of each command, imported when the command is used."""
LONGEST_HELP = 200
"""Characters of a command's first sentence, which is wrapped and not cut."""


class LazyGroup(click.Group):
    """The group of `COMMANDS`; its help lists them by `SECTIONS`, each with its first sentence."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"{__package__}.{COMMANDS[cmd_name]}")
        command: click.Command = getattr(module, cmd_name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each heading."""
        for heading, names in SECTIONS.items():
            commands = {name: self.get_command(ctx, name) for name in names}
            with formatter.section(heading):
                formatter.write_dl(
                    [
                        (name, command.get_short_help_str(LONGEST_HELP))
                        for name, command in commands.items()
                        if command is not None
                    ]
                )


def _show_version(context: click.Context, option: click.Parameter, is_asked: bool) -> None:
    if is_asked and not context.resilient_parsing:
        from ..processes.software import installed_version

        click.echo(f"space-robot, version {installed_version('space_robot') or 'unknown'}")
        context.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """Fly a satellite with a robot arm: flight software on a ROS 2 graph, or in one process.

    \b
    Examples:
      space-robot fly                               case 1 under TDE-STC, as a graph of nodes
      space-robot fly --controller ctc --case 3     another law, another case
      space-robot simulate --json                   the same flight without ROS
      space-robot examples                          programs to run and to change
      space-robot robot my.urdf                     contents of a robot's file
      space-robot urdf paper                        a robot as a URDF, for RViz and others
      space-robot new my.urdf                       a folder for it: mission, gains, a first flight
      space-robot gains check                       margin and noise gain of a gain set
      space-robot gains tune -o my_gains            a gain set for a robot and a mission
      space-robot analyze flights/<bag>...          metrics of recorded flights
      space-robot view flights/<bag>                the robot in 3-D with plots, as one page
      space-robot replay flights/<bag>              recorded states answered anew
      space-robot sim step --ticks 10               a running graph, paused and stepped
      space-robot campaign run sensor_grades        laws over grades of sensors
      space-robot campaign run FILE --runs 1000     dispersed flights: verdicts with confidence
      space-robot trace                             requirements, verified by flights and tests
      space-robot reproduce                         the paper's Table V and figures
      space-robot doctor                            what this machine has for flights
      space-robot help                              short answers by topic
    """


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Entry point: one clear line on standard error instead of a traceback.

    ``space-robot plant_node`` and the like, which ``ros2 run`` starts, are the nodes themselves.
    Exit code 2 on bad input, 1 on a failed flight, 128 and its number on a signal.
    """
    if arguments is None and sys.argv[1:] and (module := _node_module(sys.argv[1])):
        del sys.argv[1]  # rclpy and the node read the rest
        import_module(module).main()
    if arguments is None:
        _relax_garbage_collection()
    hold_to_standard_input()  # if another command of this project has started this one
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with raising_signals():
        code = _run(arguments)
    sys.exit(code)


def _relax_garbage_collection() -> None:
    # what is imported is never freed, and to search it takes a fifth of a short command's time
    gc.set_threshold(COLLECTED_AT)
    atexit.register(gc.freeze)


def _node_module(word: str) -> str | None:
    return MODULES.get(word.removesuffix(SUFFIX)) if word.endswith(SUFFIX) else None


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command; return its exit code."""
    try:
        code = cli.main(args=arguments, prog_name="space-robot", standalone_mode=False)
        sys.stdout.flush()
    except click.Abort as abort:  # click's word for KeyboardInterrupt, and for the input's end
        interrupted = abort.__cause__
        click.echo(f"space-robot: {interrupted}", err=True)
        return interrupted.exit_code if isinstance(interrupted, Interrupted) else 130
    except click.ClickException as error:
        _print_error(_usage_line(error))
        return 2
    except SpaceRobotError as error:
        words = sys.argv[1:] if arguments is None else arguments
        _print_error(_error_line(error, words[0] if words else ""))
        return error.exit_code
    except OSError as error:
        return _report_os_error(error)
    return code if isinstance(code, int) else 0


def _report_os_error(error: OSError) -> int:
    """Report a failed read or write, unless the pipe is closed; return the exit code."""
    if error.filename is None:
        with suppress(OSError, ValueError):  # the interpreter flushes its output at the end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if not isinstance(error, BrokenPipeError):
        _print_error(f"{error.filename or 'standard output'}: {error.strerror or error}")
    return 1


def _print_error(text: str) -> None:
    lines = (printable(line) for line in text.split("\n"))
    click.echo("space-robot: error: " + "\n".join(lines), err=True)


def _error_line(error: SpaceRobotError, command: str) -> str:
    text = str(error)
    topic = error.help_topic or ("install" if "pip install " in text else "")
    topic = topic or _HELP_TOPICS.get(command, "")
    return f"{text} (see: space-robot help {topic})" if topic else text


def _usage_line(error: click.ClickException) -> str:
    context = error.ctx if isinstance(error, click.UsageError) else None
    text = _reworded(error, context)
    return f"{text} (see: {context.command_path} --help)" if context else text


def _reworded(error: click.ClickException, context: click.Context | None) -> str:
    if isinstance(error, click.NoSuchOption) and context:
        names = [name for item in context.command.params for name in item.opts]
        return f"no such option {error.option_name}: {choices(error.option_name, names)}"
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        return _value_error(error)
    text = error.format_message()
    if (command := _NO_COMMAND.match(text)) and context:
        group = context.command
        names = group.list_commands(context) if isinstance(group, click.Group) else []
        return f"no such command {command[1]!r}: {choices(command[1], names)}"
    if extra := _EXTRA.match(text):
        return f"unexpected argument {extra[1]!r}"
    return text[:1].lower() + text[1:].removesuffix(".")


def _value_error(error: click.BadParameter) -> str:
    option, text = error.param, " ".join(error.message.split())
    kind = option.type if option else None
    if number := _NO_NUMBER.fullmatch(text):
        purpose = getattr(option, "help", None)
        about = f"; it is: {' '.join(purpose.split()).removesuffix('.')}" if purpose else ""
        text = f"{_KINDS[number[2]]} was expected, got {number[1]}{about}"
    elif (choice := _NO_CHOICE.fullmatch(text)) and isinstance(kind, click.Choice):
        names = choices(choice[1].strip("'"), [str(name) for name in kind.choices])
        text = f"unknown value {choice[1]}: {names}"
    name = option.opts[0] if isinstance(option, click.Option) else error.param_hint
    if name is None and option:
        name = option.human_readable_name
    return f"{name}: {text.removesuffix('.')}" if name else text.removesuffix(".")


if __name__ == "__main__":
    main()
