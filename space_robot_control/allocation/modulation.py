"""Pulse modulation of thrusters with the demanded mean torque.

The impulse that is owed, demanded less given, is kept as a vector e, so opposite demands cancel
before a valve opens, and what no pulse could be made of is carried over. Torques that a thruster
makes about other axes than the one it is fired for are owed, too. The force on the base is owed
as well (zero is demanded), but forgotten with `FORCE_TIME`: not every layout can pay it back.

- Pulse width (`pwm`): at the beginning of each period, non-negative least squares give the times
  for the impulse owed and demanded until its end; each thruster opens once.
- Sigma-delta (`sigma_delta`): slots as long as the longest of the shortest pulses; for each the
  thrusters are opened that bring e nearest to zero, the best first.
- Schmitt trigger (`schmitt`): a thruster opens when e, less what others are about to give, is
  ``schmitt_on`` of its shortest pulses or more along its wrench, and closes at ``schmitt_off``.

Wie, Space Vehicle Dynamics and Control, 7; Sidi, Spacecraft Dynamics and Control, 9. With the last
two e stays within ``e . b_j <= threshold |b_j|^2``, a bounded polyhedron if torques in all
directions can be had. No valve is open for less than its shortest pulse. A demand beyond all
thrusters is cut to what they can give, in its direction, and the rest of it is not owed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS

from .settings import AllocationSettings
from .thrusters import AssumedThrusters, along, find_times, forget_missed, within_reach

Array = NDArray[np.float64]

PWM, SIGMA_DELTA, SCHMITT = range(3)
MODULATIONS = ("pwm", "sigma_delta", "schmitt")
NEAREST = 0.5
"""Share of a pulse that must be owed so that firing it reduces the impulse owed."""
FORCE_TIME = 2.0
"""Time constant in which an owed force on the base is forgotten, s."""
ROUNDING = 1e-9
"""Relative tolerance of thresholds."""


class Modulation(Record):
    """Settings and memory of the modulation."""

    kind: float = shaped(lambda n: ())
    """`PWM`, `SIGMA_DELTA` or `SCHMITT`."""
    slot: float = shaped(lambda n: ())
    """Ticks from one decision to the next."""
    on: float = shaped(lambda n: ())
    """Shortest pulses owed at which the Schmitt trigger opens a thruster."""
    off: float = shaped(lambda n: ())
    """Shortest pulses owed at which it closes it."""
    forget: float = shaped(lambda n: ())
    """Share of the force owed that is forgotten in a tick."""
    tick: float = shaped(lambda n: ())
    """Last tick; -1: none."""
    slot_left: float = shaped(lambda n: ())
    """Ticks until the next decision."""
    reach: float = shaped(lambda n: ())
    """Share of the demand that the thrusters can give, at the last decision."""
    demand: Array = shaped(lambda n: (6,))
    """N m; see `AssumedThrusters.wrench`. No force is demanded."""
    owed: Array = shaped(lambda n: (6,))
    """e, N m s."""
    open_for: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which each valve will stay open."""
    impulse: Array = shaped(lambda n: (6,))
    """Scratch."""
    pulses: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Number of pulses so far."""

    @classmethod
    def build(
        cls, n: int, thrusters: AssumedThrusters, settings: AllocationSettings, period: float
    ) -> Modulation:
        """Read the settings; ``period`` of a tick in s."""
        modulation = cls.allocate(n)
        longest = float(np.max(thrusters.shortest))
        ticks = {
            "pwm": max(round(settings.modulation_period / period), longest, 1.0),
            "sigma_delta": max(longest, 1.0),
            "schmitt": 1.0,
        }
        assign(
            modulation,
            kind=MODULATIONS.index(settings.modulation),
            tick=-1.0,
            slot=ticks[settings.modulation],
            on=settings.schmitt_on,
            off=settings.schmitt_off,
            forget=min(1.0, period / FORCE_TIME),
        )
        return modulation


@kernel
def modulate(modulation: Modulation, thrusters: AssumedThrusters, tick: int, demand: Array) -> None:
    """Write which thrusters are open from ``tick`` on, for a ``demand`` (3,) N m."""
    count, owed, open_for = int(thrusters.count), modulation.owed, modulation.open_for
    if tick != modulation.tick + 1.0:  # nobody knows what was given meanwhile
        owed[:] = 0.0
        modulation.slot_left = 0.0
        open_for[:] = 0.0
        thrusters.is_open[:] = 0.0
        forget_missed(thrusters, int(modulation.tick), tick)
    modulation.tick = tick
    for i in range(3):
        modulation.demand[i] = demand[i]
    if modulation.slot_left <= 0.0:
        modulation.slot_left = modulation.slot
        modulation.reach = within_reach(thrusters, modulation.demand)
        _decide(modulation, thrusters)
    modulation.slot_left -= 1.0
    for i in range(3):
        owed[i] += modulation.reach * demand[i] * thrusters.period
        owed[3 + i] -= owed[3 + i] * modulation.forget
    for j in range(count):
        is_open = 1.0 if open_for[j] > 0.0 else 0.0
        modulation.pulses[j] += is_open * (1.0 - thrusters.is_open[j])
        thrusters.is_open[j] = is_open
        open_for[j] -= is_open
        for i in range(6):
            owed[i] -= is_open * thrusters.wrench[j, i] * thrusters.period


@subroutine
def _decide(modulation: Modulation, thrusters: AssumedThrusters) -> None:
    """Set the opening time of each valve."""
    impulse, open_for, period = modulation.impulse, modulation.open_for, thrusters.period
    for i in range(6):
        ahead = modulation.reach * modulation.demand[i] * modulation.slot * period
        impulse[i] = modulation.owed[i] + ahead
    if modulation.kind == PWM:
        find_times(thrusters, impulse)
        _cut(modulation, thrusters)
        for j in range(int(thrusters.count)):
            ticks = np.floor(thrusters.problem.x[j] / period * (1.0 + ROUNDING) + 0.5)
            open_for[j] = ticks if ticks >= thrusters.shortest[j] else 0.0
    elif modulation.kind == SIGMA_DELTA:
        for j in range(int(thrusters.count)):
            open_for[j] = 0.0
        while _open_best(modulation, thrusters, NEAREST, modulation.slot):
            pass
    else:
        _trigger(modulation, thrusters)


@subroutine
def _trigger(modulation: Modulation, thrusters: AssumedThrusters) -> None:
    """Open and close thrusters by the Schmitt trigger; ``impulse`` is what is owed."""
    impulse, open_for = modulation.impulse, modulation.open_for
    for j in range(int(thrusters.count)):  # what is under way is as good as given
        for i in range(6):
            impulse[i] -= thrusters.wrench[j, i] * open_for[j] * thrusters.period
    for j in range(int(thrusters.count)):
        if thrusters.is_open[j] == 1.0 and open_for[j] == 0.0:  # it has been open for long enough
            least = modulation.off * thrusters.shortest[j]
            if owed_ticks(modulation, thrusters, j) > least + ROUNDING * thrusters.shortest[j]:
                _open(modulation, thrusters, j, 1.0)
    while _open_best(modulation, thrusters, modulation.on, 0.0):
        pass


@kernel
def owed_ticks(modulation: Modulation, thrusters: AssumedThrusters, j: int) -> float:
    """Return the opening time of a thruster that minimises ``impulse``, in ticks."""
    square = thrusters.problem.gram[j, j] * thrusters.period
    ticks: float = along(thrusters, j, modulation.impulse) / square if square > 0.0 else 0.0
    return ticks


@subroutine
def _open_best(
    modulation: Modulation, thrusters: AssumedThrusters, threshold: float, slot: float
) -> bool:
    """Open the thruster with the largest owed impulse, if ``threshold`` pulses or more.

    A pulse is a ``slot`` of ticks (0: the thruster's shortest). ``impulse`` is then less by it.
    """
    best, most, ticks = -1, 0.0, 0.0
    for j in range(int(thrusters.count)):
        if modulation.open_for[j] > 0.0:
            continue
        pulse = slot if slot > 0.0 else thrusters.shortest[j]
        wanted = owed_ticks(modulation, thrusters, j)
        gain = wanted * along(thrusters, j, modulation.impulse)
        if wanted >= threshold * pulse * (1.0 - ROUNDING) and gain > most:
            best, most, ticks = j, gain, pulse
    if best < 0:
        return False
    _open(modulation, thrusters, best, ticks)
    return True


@subroutine
def _open(modulation: Modulation, thrusters: AssumedThrusters, j: int, ticks: float) -> None:
    modulation.open_for[j] = ticks
    for i in range(6):
        modulation.impulse[i] -= thrusters.wrench[j, i] * ticks * thrusters.period


@subroutine
def _cut(modulation: Modulation, thrusters: AssumedThrusters) -> None:
    """Limit the times to a period, and the impulse owed accordingly."""
    excess, longest = 1.0, modulation.slot * thrusters.period
    for j in range(int(thrusters.count)):
        excess = max(excess, thrusters.problem.x[j] / longest)
    if excess == 1.0:
        return
    for j in range(int(thrusters.count)):
        thrusters.problem.x[j] /= excess
    for i in range(6):
        modulation.owed[i] -= modulation.impulse[i] * (1.0 - 1.0 / excess)
