"""The command ``space-robot simulate``: fly a mission in this process, without ROS."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from .options import ON_A_FLIGHT, flight_options, plan_flight, remarks_on

SECTION = "Fly"


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
    _ = flight.supervisor  # compiled, or refused, before anything is begun
    compile_kernels(bool(flight.plant.names.actuators))  # it has a progress line of its own
    began = time.monotonic()
    with flight_progress(flight.ticks * flight.period, flight.law.name) as show:

        def progress(simulated_s: float) -> None:
            show(simulated_s, f"{simulated_s / (time.monotonic() - began):.0f} times real time")

        flown = fly_in_process(flight, bag, progress, keep_log=False)
    if as_json or flown.metrics:
        show_report(flown.report(), as_json)
    if bag and flown.metrics and not as_json:
        show_next_steps(bag)
    flown.check()
