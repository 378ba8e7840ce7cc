"""The ``space-robot`` command. Heavy imports wait until a subcommand needs them."""

from __future__ import annotations

import atexit
import gc
import pkgutil
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import NoReturn

import click

from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process import hold_to_standard_input

from ..console.streams import is_of_output, standard_streams
from ..processes.interruption import Interrupted, raising_signals
from ..processes.memory import COLLECTED_AT
from ..processes.node_modules import MODULES, SUFFIX
from .error_lines import error_line, usage_line
from .sections import SectionedGroup


def _show_version(context: click.Context, option: click.Parameter, is_asked: bool) -> None:
    if is_asked and not context.resilient_parsing:
        from ..processes.software import installed_version

        click.echo(f"space-robot, version {installed_version('space_robot') or 'unknown'}")
        context.exit()


@click.group(cls=SectionedGroup, context_settings={"help_option_names": ["-h", "--help"]})
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
      space-robot reproduce                         the paper's Table V and figures
      space-robot doctor                            what this machine has for flights
      space-robot help                              short answers by topic
    """


def commands() -> Iterator[click.Command]:
    """Yield the commands of this folder; each is named as its file."""
    folder = import_module(__package__)
    for module in pkgutil.iter_modules(folder.__path__):
        if "_" not in module.name and module.name != "main":
            value = getattr(import_module(f"{__package__}.{module.name}"), module.name, None)
            if isinstance(value, click.Command):
                yield value


for command in commands():
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Entry point: one clear line on standard error instead of a traceback.

    ``space-robot plant_node`` and the like, which ``ros2 run`` starts, are the nodes themselves.
    Exit code 2 on bad input, 1 on a failed flight, 128 and its number on a signal.
    """
    if arguments is None and sys.argv[1:] and (module := _node_module(sys.argv[1])):
        del sys.argv[1]  # rclpy and the node read the rest
        import_module(module).main()
    if arguments is None:
        _keep_what_is_loaded()
    hold_to_standard_input()  # if another command of this project has started this one
    with raising_signals(), standard_streams():
        code = _run(arguments)
    sys.exit(code)


def _keep_what_is_loaded() -> None:
    """Have the collector look seldom through what is imported, and not at all at the end.

    Nothing of it is ever let go, and to look takes a fifth of a short command's time.
    """
    gc.set_threshold(COLLECTED_AT)
    atexit.register(gc.freeze)


def _node_module(word: str) -> str | None:
    """Return the module of the node with this name, or None."""
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
        _complain(usage_line(error))
        return 2
    except SpaceRobotError as error:
        words = sys.argv[1:] if arguments is None else arguments
        _complain(error_line(error, words[0] if words else ""))
        return error.exit_code
    except OSError as error:
        return _lost(error)
    return code if isinstance(code, int) else 0


def _lost(error: OSError) -> int:
    """Report a failed read or write, unless the pipe is closed; return the exit code."""
    if not is_of_output(error):
        _complain(f"{error.filename or 'the system'}: {error.strerror or error}")
    elif not isinstance(error, BrokenPipeError):
        _complain(f"standard output cannot be written ({error.strerror or error})")
    return 1


def _complain(text: str) -> None:
    lines = (printable(line) for line in text.split("\n"))
    click.echo("space-robot: error: " + "\n".join(lines), err=True)


if __name__ == "__main__":
    main()
