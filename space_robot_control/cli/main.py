"""The ``space-robot`` command. Heavy imports wait until a subcommand needs them."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import click

from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.lifeline import hold_to_standard_input

from ..flight.interruption import Interrupted, raising_signals
from ..flight.node_modules import MODULES, SUFFIX
from .analyze import analyze
from .options import OPTIONS, flight_options
from .replay import replay
from .reproduce import reproduce
from .soak import soak
from .stability import stability
from .streams import is_of_output, standard_streams


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="space_robot", prog_name="space-robot")
def cli() -> None:
    """Fly a satellite with a robot arm: flight software on a ROS 2 graph, or in one process.

    \b
    Examples:
      space-robot fly                               case 1 under TDE-STC, as a graph of nodes
      space-robot fly --controller ctc --case 3     another law, another case
      space-robot simulate --json                   the same flight without ROS
      space-robot analyze flights/<bag>...          figures of merit of recorded flights
      space-robot replay flights/<bag>              its states to a live controller, compared
      space-robot reproduce                         the paper's Table V and figures, flown again
      space-robot soak --minutes 5                  flights with faults drawn by chance
    """


def _plan(**options: Any) -> Any:
    from space_robot_msgs_py.config.validation import validate

    from ..flight.plan import Flight, FlightPlan

    return Flight(validate(FlightPlan, options, "options"))


def _faults(context: click.Context, given: Sequence[str]) -> Sequence[str]:
    if list(given) == ["list"]:
        from space_robot_sim.faults.catalogue import KINDS, help_lines

        click.echo("\n".join(help_lines(KINDS)))
        context.exit()
    return given


def _report(report: dict[str, Any], as_json: bool) -> None:
    from ..flight.terminal import echo_json, terminal

    if as_json:
        echo_json(report)
        return
    from .report_display import print_report

    print_report(report, terminal())


@cli.command()
@flight_options(*OPTIONS)
@click.option("--realtime", is_flag=True, help="Pace by the wall clock instead of lockstep.")
@click.option(
    "--fifo-priority",
    type=click.IntRange(0, 98),
    default=0,
    help="Ask for SCHED_FIFO for plant and controller; for machines with cores to spare.",
)
@click.option(
    "--fault", "faults", multiple=True, metavar="KIND@T[-END][:ARG]",
    help="Inject a fault at T simulated seconds; may be repeated; --fault list lists all kinds.",
    callback=lambda context, option, given: _faults(context, given),
)  # fmt: skip
@click.option("--seed", type=int, default=0, help="Seed of the faults' random numbers.")
@click.option("--restart-controller", is_flag=True, help="Start a dead or hung controller again.")
@click.option("--domain", type=int, help="ROS domain [default: ROS_DOMAIN_ID, or a free one].")
def fly(as_json: bool, bag: Path | None, **options: Any) -> None:
    """Fly a mission on a ROS 2 graph, record it, and print the RMS table.

    Starts plant, controller, mission and recorder as processes of their own (through `ros2 run`
    where that is installed), configures and activates them, follows the flight, stops them,
    checks the bag. Set ROS_DOMAIN_ID or --domain to watch the flight from another terminal.

    \b
    Examples:
      space-robot fly --controller tde_smc --duration 5
      space-robot fly --case 4-2 --bag flights/heavy --json
      space-robot fly --command-latency-ticks 2
      space-robot fly --swap 5:tde_smc --swap 10:tde_stc
      space-robot fly --fault kill_controller@3 --restart-controller
      space-robot fly --fault drop_state@2-4:0.1 --fault noise_gyro@0:1e-5 --seed 7
    """
    from ..analysis import analyze
    from ..flight.graph.orchestrator import fly as fly_graph
    from .failure import told_as_json

    flight = _plan(**options)
    bag = bag or flight.default_bag()
    with told_as_json(flight, bag, as_json):
        report = fly_graph(flight, bag, analyze)
    _report(report, as_json)
    if failures := report["graph"]["failures"]:
        from space_robot_msgs_py.errors import FlightError

        raise FlightError("; ".join(failures))


@cli.command()
@flight_options(*OPTIONS)
def simulate(as_json: bool, bag: Path | None, **options: Any) -> None:
    """Fly the same mission in this process, without ROS; the numbers are those of `fly`.

    \b
    Examples:
      space-robot simulate --controller tde_tsmc
      space-robot simulate --no-friction --case 2 --json
      space-robot simulate --bag flights/in_process
    """
    from contextlib import closing

    from space_robot_msgs_py.errors import FlightError

    from ..analysis import Analysis
    from ..flight.compilation import compile_kernels
    from ..flight.disk_space import room_remark
    from ..flight.plan import check_bag_path
    from ..flight.progress import flight_progress
    from ..flight.simulate import fly_blocks
    from .failure import failed_report

    flight = _plan(**options)
    flight.check_in_process()
    if bag:
        check_bag_path(bag)
        if remark := room_remark(flight, bag):
            click.echo(remark, err=True)
    compile_kernels()
    period, analysis, began = flight.period, Analysis(), time.monotonic()
    with flight_progress(flight.ticks * period, flight.controller.law.name) as show:

        def progress(tick: int) -> None:
            rate = tick * period / (time.monotonic() - began)
            show(tick * period, f"{rate:.0f} times real time")

        failure = None
        with closing(fly_blocks(flight, bag, progress)) as blocks:
            try:
                for block in blocks:
                    analysis.add(block)
            except FlightError as error:
                failure = error
    report = analysis.report() if analysis.ticks else {}
    if failure and as_json:
        report = failed_report(flight, bag, failure, report)
    if report:
        _report(report, as_json)
    if failure:
        raise failure


cli.add_command(analyze)
cli.add_command(replay)
cli.add_command(reproduce)
cli.add_command(soak)
cli.add_command(stability)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Entry point: one clear line on standard error instead of a traceback.

    ``space-robot plant_node`` and the like, which ``ros2 run`` starts, are the nodes themselves.
    Exit code 2 on bad input, 1 on a failed flight, 128 and its number on a signal.
    """
    if arguments is None and sys.argv[1:] and (module := _node_module(sys.argv[1])):
        del sys.argv[1]  # rclpy and the node read the rest
        import_module(module).main()
    hold_to_standard_input()  # if another command of this project has started this one
    with raising_signals(), standard_streams():
        code = _run(arguments)
    sys.exit(code)


def _node_module(word: str) -> str | None:
    """The module of the node that is called so, if there is one."""
    return MODULES.get(word.removesuffix(SUFFIX)) if word.endswith(SUFFIX) else None


def _run(arguments: Sequence[str] | None) -> int:
    """The exit code of a command."""
    try:
        cli.main(args=arguments, prog_name="space-robot", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.Exit as exit_:
        return exit_.exit_code
    except click.Abort as abort:  # click's word for KeyboardInterrupt, and for the input's end
        interrupted = abort.__cause__
        click.echo(f"space-robot: {interrupted}", err=True)
        return interrupted.exit_code if isinstance(interrupted, Interrupted) else 130
    except click.ClickException as error:
        error.show()
        return 2
    except SpaceRobotError as error:
        _complain(str(error))
        return error.exit_code
    except OSError as error:
        return _lost(error)
    return 0


def _lost(error: OSError) -> int:
    """The exit code when something could not be written or read; says what, unless nobody reads."""
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
