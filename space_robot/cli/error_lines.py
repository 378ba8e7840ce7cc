"""Errors as the one line that the command line shows, with where to read on."""

from __future__ import annotations

import re

import click

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.errors import SpaceRobotError

_NO_COMMAND = re.compile(r"No such command '(.*?)'")
_EXTRA = re.compile(r"Got unexpected extra arguments? \((.*)\)")
_NO_NUMBER = re.compile(r"(.*) is not a valid (float|integer)( range)?\.")
_NO_CHOICE = re.compile(r"(.*) is not one of .*\.")
_KINDS = {"float": "a number", "integer": "a whole number"}
_INSTALLS = "pip install "
QUOTE = "'"
_OF_COMMANDS = {"campaign": "campaign", "gains": "gains", "plan": "own-trajectory"}
"""Topics of commands, for errors without a topic of their own."""


def error_line(error: SpaceRobotError, command: str = "") -> str:
    """Return the message with the topic of help that explains it, if there is one.

    Args:
        error: that ended the command.
        command: its name.
    """
    text = str(error)
    topic = error.help_topic or ("install" if _INSTALLS in text else "")
    topic = topic or _OF_COMMANDS.get(command, "")
    return f"{text} (see: space-robot help {topic})" if topic else text


def usage_line(error: click.ClickException) -> str:
    """Return click's message on wrong options or arguments in this project's words, in a line."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    text = _reworded(error, context)
    return f"{text} (see: {context.command_path} --help)" if context else text


def _reworded(error: click.ClickException, context: click.Context | None) -> str:
    if isinstance(error, click.NoSuchOption) and context:
        names = [name for item in context.command.params for name in item.opts]
        return f"no such option {error.option_name}: {choices(error.option_name, names)}"
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        return _on_value(error)
    text = error.format_message()
    if (command := _NO_COMMAND.match(text)) and context:
        group = context.command
        commands = group.commands if isinstance(group, click.Group) else {}
        names = [name for name, item in commands.items() if not item.hidden]
        return f"no such command {command[1]!r}: {choices(command[1], names)}"
    if extra := _EXTRA.match(text):
        return f"unexpected argument {extra[1]!r}"
    return text[:1].lower() + text[1:].removesuffix(".")


def _on_value(error: click.BadParameter) -> str:
    """Return what is wrong with a value: the option, what is allowed, what it is for."""
    option, text = error.param, " ".join(error.message.split())
    kind = option.type if option else None
    if number := _NO_NUMBER.fullmatch(text):
        purpose = getattr(option, "help", None)
        about = f"; it is: {' '.join(purpose.split()).removesuffix('.')}" if purpose else ""
        text = f"{_KINDS[number[2]]} was expected, got {number[1]}{about}"
    elif (choice := _NO_CHOICE.fullmatch(text)) and isinstance(kind, click.Choice):
        names = [str(name) for name in kind.choices]
        text = f"unknown value {choice[1]}: {choices(choice[1].strip(QUOTE), names)}"
    name = option.opts[0] if isinstance(option, click.Option) else error.param_hint
    if name is None and option:
        name = option.human_readable_name
    return f"{name}: {text.removesuffix('.')}" if name else text.removesuffix(".")
