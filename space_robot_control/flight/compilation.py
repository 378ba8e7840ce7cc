"""Compiling everything a flight needs before it starts, once an installation."""

from __future__ import annotations

import click

from space_robot_msgs_py.compiled import cache_directory

from ..laws import laws
from .plan import Flight, FlightPlan
from .simulate import simulate

MARK = "complete"


def compile_kernels() -> None:
    """Fly a few ticks under every law, unless that has been done since the last change.

    Else the nodes would compile the same functions side by side in their first tick.
    """
    mark = cache_directory() / MARK
    if mark.exists():
        return
    click.echo("compiling the dynamics and the laws (once, about half a minute) ...", err=True)
    for law in laws():
        flight = Flight(FlightPlan(controller=law, duration=0.002))
        log = simulate(flight)
        # and the entries of the nodes
        flight.plant.step(flight.controller.update(log.state(0), *log.reference(0)))
    mark.touch()
