"""``space-robot gains``."""

from __future__ import annotations

from typing import Any

import click

from .options import flight_options


@click.group()
def gains() -> None:
    """Look at a gain set before it flies, or make one."""


@gains.command()
@click.option(
    "--controller", default="all", show_default=True,
    help="A law's name, or module:Class of your own; all: every law that the gain set has.",
)  # fmt: skip
@flight_options("case", "gains", "robot", "mission", "set", "json")
def check(as_json: bool, **options: Any) -> None:
    """Tell which margin and noise gain the laws of a gain set have along a mission.

    Nothing is flown. For laws with time-delay estimation: the eigenvalues of H_S^-1 h_bar, the
    radius of E - H_S^-1 h_bar, the share by which the torque reported may exceed the one
    commanded. For all laws: the torque that noise on the measured rates becomes. Exit code 1
    if the radius is 1 or more or the margin below 2 % for any of the laws.

    \b
    Examples:
      space-robot gains check
      space-robot gains check --controller tde_stc --gains my_gains/
      space-robot gains check --case 4-2 --set controller.tde_stc.h_bar='[200.]'
    """
    from space_robot_msgs_py.errors import SpaceRobotError

    from ..flight.terminal import echo_json, terminal
    from .gains_checked import checked, report_of
    from .gains_display import print_checks

    found = checked(options)
    if as_json:
        echo_json(report_of(found))
    else:
        print_checks(found, terminal())
    if not found.is_sound:
        names = ", ".join(check.law for check in found.checks if not check.is_sound)
        raise SpaceRobotError(f"{names}: h_bar leaves too little margin in torque scale")
