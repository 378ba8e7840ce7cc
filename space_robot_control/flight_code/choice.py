"""What answers as the controller: the kernels, the flight code in C, or a flight computer."""

from __future__ import annotations

from collections.abc import Sequence

from space_robot_msgs_py.errors import InputError

from ..controller.controller import Controller
from ..controller.settings import ControllerNodeSettings
from ..controller.supervisor import Supervisor
from ..laws import ControlLaw


def supervisor_of(
    controller: Controller, laws: Sequence[ControlLaw], settings: ControllerNodeSettings
) -> Supervisor:
    """Return the supervisor that the settings ask for.

    Args:
        controller: with the law in force at the start.
        laws: all laws that it may be given, that one first.
        settings: of the controller's node.

    Raises:
        InputError: a law cannot be exported, or there is no compiler or no flight computer.
    """
    limits = settings.hold_ticks, settings.longest_jump
    if settings.answers_in_python:
        return Supervisor(controller, *limits)
    if settings.controller_code != "python" and settings.shadow != "none":
        raise InputError(
            f"shadow {settings.shadow} compares C with Python: it needs controller_code python, "
            f"got {settings.controller_code}"
        )
    # most flights need no translator
    from .folder import Exported
    from .library import FlightLibrary
    from .remote import FlightComputer
    from .software import FlightSoftware
    from .supervisors import CodeSupervisor, ShadowSupervisor

    exported = Exported(FlightSoftware.of(controller, laws, [], limits, {}), settings.robot)
    if settings.controller_code.startswith("udp:"):
        _, host, port = settings.controller_code.split(":")
        return CodeSupervisor(controller, settings, FlightComputer(exported, host, int(port)))
    kind = CodeSupervisor if settings.controller_code == "c" else ShadowSupervisor
    return kind(controller, settings, FlightLibrary(exported))
