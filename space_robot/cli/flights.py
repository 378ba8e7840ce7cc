"""The commands ``space-robot fly``, ``simulate`` and ``scenario``."""

from __future__ import annotations

import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import click

from .options import ON_A_FLIGHT, ON_A_GRAPH, file_option, flight_options, plan_flight, remarks_on


@click.command()
@flight_options(*ON_A_GRAPH)
def fly(as_json: bool, bag: Path | None, **options: Any) -> None:
    """Fly a mission on a ROS 2 graph, record it, and print the RMS table.

    Starts plant, controller, mission and recorder as separate processes (through `ros2 run`
    where it is installed), or with --composed in one process; configures and activates them,
    monitors the flight, stops them, checks the bag. Set ROS_DOMAIN_ID or --domain to watch the
    flight from another terminal.

    \b
    Examples:
      space-robot fly --controller tde_smc --duration 5
      space-robot fly --case 4-2 --bag flights/heavy --json
      space-robot fly --command-latency-ticks 2
      space-robot fly --composed --realtime
      space-robot fly --domain 7 --namespace /sat1
      space-robot fly --swap 5:tde_smc --swap 10:tde_stc
      space-robot fly --fault kill_controller@3 --restart-controller
      space-robot fly --event capture@10:target.yaml
      space-robot fly --fault drop_state@2-4:0.1 --fault noise_gyro@0:1e-5 --seed 7
    """
    from ..flight.graph.processes import begin_loading

    begin_loading()  # while this process looks at the options
    from space_robot_msgs_py.bag.reader import read_flight
    from space_robot_msgs_py.errors import FlightError, InputError

    from ..analysis import analyze
    from ..api.flown_flight import flight_report
    from ..console.terminal import echo_json
    from ..flight.ending import Ending
    from ..flight.flight_messages import check_bag_path, default_bag
    from ..flight.graph.orchestrator import fly as fly_graph
    from .report_display import show_next_steps, show_report

    flight = plan_flight(**options)
    bag = bag or default_bag(flight)
    check_bag_path(bag)
    _ = flight.supervisor  # compiled, or refused, before anything is begun
    try:
        report = fly_graph(flight, bag, partial(analyze, in_brief=not as_json), remarks_on(flight))
    except FlightError as error:
        if as_json:
            metrics: dict[str, Any] = {}
            with suppress(InputError):  # no tick is complete
                metrics = analyze(read_flight(bag, trust=True))
            echo_json(flight_report(flight, Ending.early(error, flight.period), metrics, bag))
        raise
    ending = Ending.complete(flight.ticks, flight.period)
    if failures := report["graph"]["failures"]:
        ending = Ending.early(FlightError("; ".join(failures)), flight.period)
    show_report({**report, **ending.as_record()}, as_json)
    if not as_json:
        show_next_steps(bag)
    ending.check()


@click.command()
@flight_options(*ON_A_FLIGHT)
def simulate(as_json: bool, bag: Path | None, **options: Any) -> None:
    """Fly a mission in this process, without ROS, with the same numbers as `fly`.

    \b
    Examples:
      space-robot simulate --controller tde_tsmc
      space-robot simulate --no-friction --case 2 --json
      space-robot simulate --bag flights/in_process
      space-robot simulate --sensors fine --seed 3
      space-robot simulate --fault torque_scale@2:base=0.99 --fault noise_gyro@0:1e-6
      space-robot simulate --event capture@10:small_satellite --event release@25:0.05
    """
    from ..api.flown_flight import fly_in_process
    from ..console.progress import flight_progress
    from ..flight.compilation import compile_kernels
    from ..flight.flight_messages import bag_remark, check_bag_path
    from .report_display import show_next_steps, show_report

    flight = plan_flight(**options)
    flight.check_in_process()
    if bag:
        check_bag_path(bag)
    for remark in filter(None, (*remarks_on(flight), bag_remark(flight) if bag else "")):
        click.echo(remark, err=True)
    if flight.flies_by_messages:
        _ = flight.supervisor  # compiled, or refused, before anything is begun
    compile_kernels(bool(flight.plant.names.actuators))  # it has a progress line of its own
    began = time.monotonic()
    with flight_progress(flight.ticks * flight.period, flight.law.name) as show:

        def progress(simulated_s: float) -> None:
            show(simulated_s, f"{simulated_s / (time.monotonic() - began):.0f} times real time")

        flown = fly_in_process(flight, bag, progress, keep_log=False, in_brief=not as_json)
    if as_json or flown.metrics:
        show_report(flown.report(), as_json)
    if bag and flown.metrics and not as_json:
        show_next_steps(bag)
    flown.check()


@click.command()
@flight_options(*(name for name in ON_A_GRAPH if name != "bag"))
@file_option("--output", help="File to write to [default: standard output].")
def scenario(as_json: bool, output: Path | None, **options: Any) -> None:
    """Print the resolved scenario: every setting of a flight, independent of files.

    The YAML (or, with --json, JSON) is itself a scenario file: `--scenario` repeats the flight
    bit by bit, without the files that it was made from.

    \b
    Examples:
      space-robot scenario --case 3 --sensors fine
      space-robot scenario --robot seven_joint --output mine.yaml
      space-robot simulate --scenario mine.yaml
    """
    import json

    import yaml

    from ..console.files import write_text

    numbers = plan_flight(**options).scenario.tree
    if as_json:
        text = json.dumps(numbers, indent=2)
    else:
        text = yaml.safe_dump(numbers, sort_keys=False, default_flow_style=None, width=100).rstrip()
    if output is None:
        click.echo(text)
    else:
        write_text(text + "\n", output)
