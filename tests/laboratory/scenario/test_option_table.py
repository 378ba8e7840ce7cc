"""Every option of a flight is declared once; all places have it."""

from __future__ import annotations

import click
import pytest

from space_robot.cli.fly import fly
from space_robot.cli.launch_arguments import launch_arguments
from space_robot.cli.simulate import simulate
from space_robot.scenario.option_table import OPTIONS, Option, names
from space_robot.scenario.options import FlightPlan

NOT_TYPED = {"parameters"}
"""With a form of its own on the command line."""


def test_the_plan_has_the_options_of_the_table() -> None:
    assert set(FlightPlan.model_fields) == {*names(), *NOT_TYPED}


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_an_option_is_the_same_everywhere(option: Option) -> None:
    field = FlightPlan.model_fields[option.name]
    assert field.description == option.help_text
    default = field.get_default(call_default_factory=True)
    assert default == ([] if option.kind == "texts" else option.default)
    of_fly, of_simulate = (
        {p.name: p for p in command.params if isinstance(p, click.Option)}
        for command in (fly, simulate)
    )
    assert option.name in of_fly
    assert (option.name in of_simulate) == (not option.needs_graph)
    launched = {
        argument.name
        for argument in launch_arguments()
        if argument.description.startswith(option.help_text.partition(" [default")[0])
    }
    flags = {max(of_fly[option.name].opts, key=len).lstrip("-").replace("-", "_")}
    assert launched == (flags if option.is_launched else set())
