"""The command ``space-robot fly``: fly a mission on a ROS 2 graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import ON_A_GRAPH, flight_options, plan_flight, remarks_on

SECTION = "Fly"


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
    from space_robot_msgs_py.errors import FlightError

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
        report = fly_graph(flight, bag, analyze, remarks_on(flight))
    except FlightError as error:
        if as_json:
            ending = Ending.early(error, flight.period)
            echo_json(flight_report(flight, ending, _recorded_metrics(bag), bag))
        raise
    ending = Ending.complete(flight.ticks, flight.period)
    if failures := report["graph"]["failures"]:
        ending = Ending.early(FlightError("; ".join(failures)), flight.period)
    show_report({**report, **ending.as_record()}, as_json)
    if not as_json:
        show_next_steps(bag)
    ending.check()


def _recorded_metrics(bag: Path) -> dict[str, Any]:
    """Return the metrics of a flight that ended early; none if no tick is complete."""
    from space_robot_msgs_py.bag.reader import read_flight
    from space_robot_msgs_py.errors import InputError

    from ..analysis import analyze

    try:
        return analyze(read_flight(bag, trust=True))
    except InputError:
        return {}
