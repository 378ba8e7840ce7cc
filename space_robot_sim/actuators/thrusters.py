"""Thrusters on the base, each open or closed.

A thruster commanded more than half of its force opens after the delay of its valve, and closes
at the earliest after its shortest pulse. Open thrusters burn ``F / (I_sp g_0)`` of the tank's
propellant; in the tick in which the tank runs empty, the rest is shared equally.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS

from ..component import Component
from ..faults.grammar import About, Argument, Kind, switch_on

Array = NDArray[np.float64]

VALVE = Argument(about=About.THRUSTER)


class Thrusters(Component):
    """Thrusters of one base; entries beyond the last thruster are zero."""

    count: float = shaped(lambda n: (), uniform=True, source="count")
    force: Array = shaped(lambda n: (MOST_THRUSTERS,), source=lambda s, at: s.values("force"))
    """Force of an open thruster, N."""
    direction: Array = shaped(lambda n: (MOST_THRUSTERS, 3), source="unit_directions")
    """Unit vectors of the force on the base, base frame."""
    lever: Array = shaped(
        lambda n: (MOST_THRUSTERS, 3), source=lambda s, at: s.torques / s.values("force")[:, None]
    )
    """Torque about the base's CoM by force, m, base frame: position x direction."""
    flow: Array = shaped(lambda n: (MOST_THRUSTERS,), source="mass_flow")
    """Propellant that an open thruster burns, kg/s."""
    shortest_pulse: Array = shaped(
        lambda n: (MOST_THRUSTERS,),
        source=lambda s, at: np.maximum(1.0, s.ticks("shortest_pulse", at.period)),
    )
    """Ticks, at least one."""
    stuck_on: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that cannot be closed."""
    stuck_off: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that cannot be opened; overrides `stuck_on`."""
    open: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that was open over the last tick."""
    remaining: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which a valve must stay open."""
    pulses: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Number of times that a valve has opened."""
    propellant: float = shaped(lambda n: (), source=lambda s, at: s.propellant or np.inf)
    """Propellant in the tank, kg; inf: unlimited."""
    burnt: float = shaped(lambda n: ())
    """Propellant used so far, kg."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind("thruster_stuck_on", VALVE, "a thruster's valve stays open", "stuck_on", switch_on),
        Kind(
            "thruster_stuck_off", VALVE, "a thruster's valve stays closed", "stuck_off", switch_on
        ),
    )


@kernel
def fire(
    thrusters: Thrusters, asked: Array, period: float, thrusts: Array, base_wrench: Array
) -> None:
    """Open and close valves; write the mean force over a tick into ``thrusts``.

    Args:
        thrusters: whose valves and tank change.
        asked: (T,) or more, force asked of each, N.
        period: of a tick, s.
        thrusts: (MOST_THRUSTERS,) N, mean over the tick, written.
        base_wrench: (6,) force, N, and torque about the CoM, N m, on base axes; theirs is added.
    """
    flow = 0.0
    for k in range(whole(thrusters.count)):
        # the command is a force, a valve is open or closed: more than half of it opens
        wanted = (asked[k] > 0.5 * thrusters.force[k]) | (thrusters.remaining[k] > 0.0)
        is_open = (wanted | (thrusters.stuck_on[k] != 0.0)) & (thrusters.stuck_off[k] == 0.0)
        opens = is_open & (thrusters.open[k] == 0.0)
        thrusters.pulses[k] += where(opens, 1.0, 0.0)
        left = where(opens, thrusters.shortest_pulse[k], thrusters.remaining[k]) - 1.0
        thrusters.remaining[k] = where(is_open & (left > 0.0), left, 0.0)
        thrusters.open[k] = where(is_open, 1.0, 0.0)
        flow += thrusters.open[k] * thrusters.flow[k]
    # in the tick in which the tank runs empty the open thrusters share the rest
    burnt = min(flow * period, thrusters.propellant)
    share = where(flow > 0.0, burnt / where(flow > 0.0, flow * period, 1.0), 0.0)
    thrusters.burnt += burnt
    thrusters.propellant -= burnt
    for k in range(whole(thrusters.count)):
        thrust = share * thrusters.open[k] * thrusters.force[k]
        thrusts[k] = thrust
        for i in range(3):
            base_wrench[i] += thrust * thrusters.direction[k, i]
            base_wrench[3 + i] += thrust * thrusters.lever[k, i]
