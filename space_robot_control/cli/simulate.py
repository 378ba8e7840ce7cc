"""``space-robot simulate``: a mission flown in this process, without ROS."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from .options import OPTIONS, flight_options, plan_flight, remarks_on


@click.command()
@flight_options(*OPTIONS)
def simulate(as_json: bool, bag: Path | None, **options: Any) -> None:
    """Fly the same mission in this process, without ROS; the numbers are those of `fly`.

    \b
    Examples:
      space-robot simulate --controller tde_tsmc
      space-robot simulate --no-friction --case 2 --json
      space-robot simulate --bag flights/in_process
      space-robot simulate --sensors fine --seed 3
      space-robot simulate --fault torque_scale@2:base=0.99 --fault noise_gyro@0:1e-6
    """
    from contextlib import closing

    from space_robot_msgs_py.errors import FlightError

    from ..analysis import Analysis
    from ..flight.bag_path import check_bag_path
    from ..flight.compilation import compile_kernels
    from ..flight.disk_space import room_remark
    from ..flight.ending import Ending
    from ..flight.progress import flight_progress
    from ..flight.simulate import fly_blocks
    from .failure import failed_report
    from .report_display import show_report

    flight = plan_flight(**options)
    flight.check_in_process()
    if bag:
        check_bag_path(bag)
        if remark := room_remark(flight, bag):
            click.echo(remark, err=True)
    for remark in remarks_on(flight):
        click.echo(remark, err=True)
    compile_kernels(bool(flight.plant.names.actuators))
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
    if not failure:
        report |= Ending.complete(flight.ticks, period).as_record()
    elif as_json:
        report = failed_report(flight, bag, failure, report)
    if report:
        show_report(report, as_json)
    if failure:
        raise failure
