"""Thrusters as the flight software knows them, and the modulation of their pulses.

Pulses t_j s of thrusters with wrenches b_j give the base an impulse ``sum b_j t_j``. Those wanted
for an angular impulse are its non-negative least squares, with the linear impulse, weighed by
``weight times mean lever arm``, as three more components: where the layout has pairs, the pulses
are pure couples. All six components are in N m s.

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

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.base_actuators import ThrusterSettings
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS

from .non_negative import NonNegative, solve
from .settings import AllocationSettings

Array = NDArray[np.float64]

LONGEST_DELAY = 256
"""Longest modelled delay of a valve, ticks."""
PWM, SIGMA_DELTA, SCHMITT = range(3)
MODULATIONS = ("pwm", "sigma_delta", "schmitt")
NEAREST = 0.5
"""Share of a pulse that must be owed so that firing it reduces the impulse owed."""
FORCE_TIME = 2.0
"""Time constant in which an owed force on the base is forgotten, s."""
ROUNDING = 1e-9
"""Relative tolerance of thresholds."""


class AssumedThrusters(Record):
    """Thrusters of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    period: float = shaped(lambda n: (), "Length of a tick, s")
    force: Array = shaped(lambda n: (MOST_THRUSTERS,), "Of each open thruster, N")
    wrench: Array = shaped(lambda n: (MOST_THRUSTERS, 6))
    """Of each open thruster: torque about the base's CoM, then its weighed force; N m, base
    frame."""
    shortest: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which a valve stays open, 1 or more."""
    delay: Array = shaped(lambda n: (MOST_THRUSTERS,), "Ticks from a command to its valve")
    peak: Array = shaped(lambda n: (2, 3))
    """Largest share of its time for which a thruster is open for a torque of 1 N m about +x, +y,
    +z, and about -x, -y, -z; 1/(N m)."""
    problem: NonNegative = nested(NonNegative)
    """Its solution: the time for which each thruster is wanted, s."""
    is_open: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for each thruster that is to be open from the present tick to the next, else 0."""
    expected: Array = shaped(lambda n: (LONGEST_DELAY, 3))
    """Ring buffer of the torque expected from commands so far, by tick, N m."""

    kind: float = shaped(lambda n: (), "`PWM`, `SIGMA_DELTA` or `SCHMITT`")
    slot: float = shaped(lambda n: (), "Ticks from one decision to the next")
    on: float = shaped(lambda n: ())
    """Shortest pulses owed at which the Schmitt trigger opens a thruster."""
    off: float = shaped(lambda n: (), "Shortest pulses owed at which it closes it")
    forget: float = shaped(lambda n: (), "Share of the force owed that is forgotten in a tick")
    modulated_at: float = shaped(lambda n: (), "Last tick; -1: none")
    slot_left: float = shaped(lambda n: (), "Ticks until the next decision")
    reach: float = shaped(lambda n: ())
    """Share of the demand that the thrusters can give, at the last decision."""
    demand: Array = shaped(lambda n: (6,), "N m; see ``wrench``. No force is demanded")
    owed: Array = shaped(lambda n: (6,), "e, N m s")
    open_for: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which each valve will stay open."""
    impulse: Array = shaped(lambda n: (6,))
    """Scratch: impulse that the pulses under decision are to give, N m s."""
    pulses: Array = shaped(lambda n: (MOST_THRUSTERS,), "Number of pulses so far")

    @classmethod
    def build(
        cls, n: int, assumed: ThrusterSettings, settings: AllocationSettings, period: float
    ) -> AssumedThrusters:
        """Read the numbers of the settings; ``period`` of a tick in s."""
        thrusters, count = cls.allocate(n), assumed.count
        wrench = np.zeros((MOST_THRUSTERS, 6))
        size, shortest, delay = np.zeros((3, MOST_THRUSTERS))
        if count:
            torque, size[:count] = assumed.torques, assumed.values("force")
            shortest[:count] = np.maximum(1.0, assumed.ticks("shortest_pulse", period))
            delay[:count] = np.minimum(assumed.ticks("delay", period), LONGEST_DELAY - 1.0)
            arm = float(np.mean(np.linalg.norm(torque, axis=1) / size[:count]))
            force = assumed.unit_directions * size[:count, None]
            wrench[:count] = np.hstack([torque, settings.force_weight * arm * force])
        longest = float(np.max(shortest))
        slots = {
            "pwm": max(round(settings.modulation_period / period), longest, 1.0),
            "sigma_delta": max(longest, 1.0),
            "schmitt": 1.0,
        }
        assign(
            thrusters,
            count=count,
            period=period,
            force=size,
            wrench=wrench,
            shortest=shortest,
            delay=delay,
            kind=MODULATIONS.index(settings.modulation),
            modulated_at=-1.0,
            slot=slots[settings.modulation],
            on=settings.schmitt_on,
            off=settings.schmitt_off,
            forget=min(1.0, period / FORCE_TIME),
        )
        assign(thrusters.problem, gram=product(wrench, wrench.T))
        # thrusters push one way: each sense of an axis has a reach of its own
        for row, side in enumerate((1.0, -1.0) if count else ()):
            for i in range(3):
                find_times(thrusters, side * np.eye(6)[i])
                thrusters.peak[row, i] = np.max(thrusters.problem.x)
        return thrusters


@kernel
def modulate(thrusters: AssumedThrusters, tick: int, demand: Array) -> None:
    """Write which thrusters are open from ``tick`` on, for a ``demand`` (3,) N m."""
    count, owed, open_for = int(thrusters.count), thrusters.owed, thrusters.open_for
    if tick != thrusters.modulated_at + 1.0:  # what was given meanwhile is not known
        owed[:] = 0.0
        thrusters.slot_left = 0.0
        open_for[:] = 0.0
        thrusters.is_open[:] = 0.0
        _forget_missed(thrusters, int(thrusters.modulated_at), tick)
    thrusters.modulated_at = tick
    thrusters.demand[:3] = demand
    if thrusters.slot_left <= 0.0:
        thrusters.slot_left = thrusters.slot
        thrusters.reach = within_reach(thrusters, thrusters.demand)
        _decide(thrusters)
    thrusters.slot_left -= 1.0
    for i in range(3):
        owed[i] += thrusters.reach * demand[i] * thrusters.period
        # no force is demanded, and what is owed fades
        owed[3 + i] -= owed[3 + i] * thrusters.forget
    for j in range(count):
        is_open = 1.0 if open_for[j] > 0.0 else 0.0
        thrusters.pulses[j] += is_open * (1.0 - thrusters.is_open[j])
        thrusters.is_open[j] = is_open
        open_for[j] -= is_open
        for i in range(6):
            owed[i] -= is_open * thrusters.wrench[j, i] * thrusters.period


@subroutine
def _decide(thrusters: AssumedThrusters) -> None:
    """Set the opening time of each valve."""
    impulse, open_for, period = thrusters.impulse, thrusters.open_for, thrusters.period
    # e as it will be at the end of the slot, if nothing is given
    for i in range(6):
        ahead = thrusters.reach * thrusters.demand[i] * thrusters.slot * period
        impulse[i] = thrusters.owed[i] + ahead
    if thrusters.kind == PWM:
        find_times(thrusters, impulse)
        _cut(thrusters)
        for j in range(int(thrusters.count)):
            ticks = np.floor(thrusters.problem.x[j] / period * (1.0 + ROUNDING) + 0.5)
            open_for[j] = ticks if ticks >= thrusters.shortest[j] else 0.0
    elif thrusters.kind == SIGMA_DELTA:
        open_for[:] = 0.0
        while _open_best(thrusters, NEAREST, thrusters.slot):
            pass
    else:
        _trigger(thrusters)


@subroutine
def _trigger(thrusters: AssumedThrusters) -> None:
    """Open and close thrusters by the Schmitt trigger; ``impulse`` is what is owed."""
    impulse, open_for = thrusters.impulse, thrusters.open_for
    for j in range(int(thrusters.count)):  # the rest of an open pulse counts as given
        for i in range(6):
            impulse[i] -= thrusters.wrench[j, i] * open_for[j] * thrusters.period
    for j in range(int(thrusters.count)):
        if thrusters.is_open[j] == 1.0 and open_for[j] == 0.0:  # it has been open for long enough
            least = thrusters.off * thrusters.shortest[j]
            if _owed_ticks(thrusters, j) > least + ROUNDING * thrusters.shortest[j]:
                _open(thrusters, j, 1.0)
    while _open_best(thrusters, thrusters.on, 0.0):
        pass


@kernel
def _owed_ticks(thrusters: AssumedThrusters, j: int) -> float:
    """Return the opening time of a thruster that minimises ``impulse``, in ticks."""
    square = thrusters.problem.gram[j, j] * thrusters.period
    ticks: float = along(thrusters, j, thrusters.impulse) / square if square > 0.0 else 0.0
    return ticks


@subroutine
def _open_best(thrusters: AssumedThrusters, threshold: float, slot: float) -> bool:
    """Open the thruster with the largest owed impulse, if ``threshold`` pulses or more.

    A pulse is a ``slot`` of ticks (0: the thruster's shortest). ``impulse`` is then less by it.
    """
    best, most, ticks = -1, 0.0, 0.0
    for j in range(int(thrusters.count)):
        if thrusters.open_for[j] > 0.0:
            continue
        pulse = slot if slot > 0.0 else thrusters.shortest[j]
        wanted = _owed_ticks(thrusters, j)
        gain = wanted * along(thrusters, j, thrusters.impulse)
        if wanted >= threshold * pulse * (1.0 - ROUNDING) and gain > most:
            best, most, ticks = j, gain, pulse
    if best < 0:
        return False
    _open(thrusters, best, ticks)
    return True


@subroutine
def _open(thrusters: AssumedThrusters, j: int, ticks: float) -> None:
    thrusters.open_for[j] = ticks
    for i in range(6):
        thrusters.impulse[i] -= thrusters.wrench[j, i] * ticks * thrusters.period


@subroutine
def _cut(thrusters: AssumedThrusters) -> None:
    """Limit the times to a period, and the impulse owed accordingly."""
    excess, longest = 1.0, thrusters.slot * thrusters.period
    for j in range(int(thrusters.count)):
        excess = max(excess, thrusters.problem.x[j] / longest)
    if excess == 1.0:
        return
    for j in range(int(thrusters.count)):
        thrusters.problem.x[j] /= excess
    for i in range(6):
        thrusters.owed[i] -= thrusters.impulse[i] * (1.0 - 1.0 / excess)


@kernel
def find_times(thrusters: AssumedThrusters, impulse: Array) -> None:
    """Write into ``problem.x`` the times, s, that give an ``impulse`` (6,) N m s."""
    problem = thrusters.problem
    for j in range(int(thrusters.count)):
        problem.right[j] = along(thrusters, j, impulse)
    solve(problem, int(thrusters.count))


@kernel
def along(thrusters: AssumedThrusters, j: int, impulse: Array) -> float:
    """Return the product of a thruster's wrench and an ``impulse`` (6,)."""
    total, wrench = 0.0, thrusters.wrench[j]
    for i in range(6):
        total += wrench[i] * impulse[i]
    return total


@kernel
def within_reach(thrusters: AssumedThrusters, demand: Array) -> float:
    """Return the share of a ``demand`` (6,) N m that thrusters open all the time can give.

    Its force is zero.
    """
    peak = 0.0
    for i in range(3):
        peak += abs(demand[i]) * thrusters.peak[0 if demand[i] > 0.0 else 1, i]
    if peak <= 1.0:  # one axis beside the other: there is at least this solution
        return 1.0
    find_times(thrusters, demand)
    peak = 1.0
    for j in range(int(thrusters.count)):
        peak = max(peak, thrusters.problem.x[j])
    return 1.0 / peak


@kernel
def expect_torque(thrusters: AssumedThrusters, tick: int, torque: Array) -> None:
    """Record the valves commanded at ``tick``; write the ``torque`` (3,) N m from then on."""
    for j in range(int(thrusters.count)):
        if thrusters.is_open[j] == 1.0:
            row = thrusters.expected[(tick + int(thrusters.delay[j])) % LONGEST_DELAY]
            for i in range(3):
                row[i] += thrusters.wrench[j, i]
    due = thrusters.expected[tick % LONGEST_DELAY]
    torque[:] = due
    due[:] = 0.0


@kernel
def _forget_missed(thrusters: AssumedThrusters, last: int, tick: int) -> None:
    """Clear the unused torque expected between the ``last`` tick and ``tick``.

    What is commanded and comes later stays; of a clock that goes back all is cleared.
    """
    missed = min(tick - last - 1, LONGEST_DELAY) if tick > last else LONGEST_DELAY
    for k in range(missed):
        row = thrusters.expected[(tick - 1 - k) % LONGEST_DELAY]
        row[:] = 0.0
