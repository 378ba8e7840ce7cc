"""Many scenarios at once, for `space_robot.fly_many` and `space_robot.bench_many`."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import partial

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..console.progress import check_progress, rated_progress
from ..flight.batch import FlightBatch, batch_obstacle, batches
from ..flight.benches import Benches
from ..flight.compilation import compile_kernels, compile_lanes
from ..flight.plan import Flight
from ..gpu.device import Device
from ..gpu.fly import MOST_FLIGHTS, device_named, fly_on_device
from .flown_flight import FlownFlight, fly_in_process
from .scenario import FlyableScenario as Scenario


def fly_many(
    scenarios: Iterable[Scenario],
    keep_log: bool = True,
    progress: Callable[[int], object] | bool | None = None,
    device: str = "cpu",
) -> list[FlownFlight]:
    """Fly scenarios in this process, eight at a time where they can share a batch.

        flights = sr.fly_many(sr.Scenario(seed=k, sensors="fine") for k in range(100))

    Each flight has the bits of `Scenario.fly`. Those of one batch have the robot's joints and
    tree, hardware, law, navigation, delays, period and duration in common, and differ in numbers:
    masses, gains, seeds, faults, missions. The others are flown one after the other.

    Args:
        scenarios: to be flown.
        keep_log: False: only the metrics are kept, for flights too many for memory.
        progress: called with the number of flights that are over; True: a progress line.
        device: ``gpu``: those that share a batch fly on an NVIDIA device, hundreds at a time.

    Returns:
        The flights, in the order of ``scenarios``.

    Raises:
        InputError: a scenario cannot be flown; names its place. Or there is no such device.
    """
    check_progress(progress)
    place = device_named(device)
    if progress is True:
        several = list(_several(scenarios))
        with rated_progress("flights") as show:
            shown = partial(show, total=len(several))
            return _fly_groups(several, keep_log, shown, place, is_shown_at_start=True)
    return _fly_groups(scenarios, keep_log, progress or None, place)


def bench_many(scenarios: Iterable[Scenario]) -> Benches:
    """Return benches of scenarios, stepped together under torques from outside.

        benches = sr.bench_many(sr.Scenario(controller=None, seed=k) for k in range(64))
        states = benches.step(np.zeros((64, 9)))

    Eight that can share a batch are in the lanes of one, see `fly_many`; the others have lanes of
    their own. Each has the bits of `Scenario.bench`.

    Args:
        scenarios: of robots with the same number of joints and the same actuators.

    Raises:
        InputError: a scenario cannot be put on a bench; names its place.
    """
    flights = [flight for _, flight in _checked(scenarios, is_flown=False)]
    compile_kernels(any(flight.plant.names.actuators for flight in flights))
    compile_lanes()
    return Benches(flights)


def _several(scenarios: Iterable[Scenario]) -> Iterable[Scenario]:
    if isinstance(scenarios, Scenario) or not isinstance(scenarios, Iterable):
        raise InputError(f"scenarios: a list of them was expected, got {short(scenarios)}")
    return scenarios


def _checked(scenarios: Iterable[Scenario], is_flown: bool = True) -> Iterator[tuple[int, Flight]]:
    """Yield number and checked flight of each scenario; ``is_flown``: under its law."""
    for number, scenario in enumerate(_several(scenarios)):
        where = f"scenario {number}"
        if not isinstance(scenario, Scenario):
            raise InputError(f"{where}: a Scenario was expected, got {short(scenario)}")
        if is_flown and scenario.controller is None:
            raise InputError(
                f"{where}: controller is None, so there is nothing to fly: use bench()"
            )
        try:
            flight = scenario.check()
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        for remark in flight.remarks if is_flown else ():
            warnings.warn(f"{where}: {remark}", stacklevel=3)
        yield number, flight


def _fly_groups(
    scenarios: Iterable[Scenario],
    keep_log: bool,
    progress: Callable[[int], object] | None,
    device: Device | None,
    is_shown_at_start: bool = False,
) -> list[FlownFlight]:
    """Fly scenarios group by group; ``is_shown_at_start``: call ``progress`` with 0, too."""
    flown: dict[int, FlownFlight] = {}
    for group in batches(_checked(scenarios), MOST_FLIGHTS if device else WIDTH):
        flights = [flight for _, flight in group]
        compile_kernels(any(flight.plant.names.actuators for flight in flights))
        if len(flights) > 1 and device is None:
            compile_lanes()
        # after the compilation, which has a progress line of its own
        if progress and is_shown_at_start and not flown:
            progress(0)
        if len(flights) == 1 and (device is None or batch_obstacle(flights[0])):
            over = [fly_in_process(flights[0], keep_log=keep_log)]
        else:
            ended = fly_on_device(flights, device) if device else FlightBatch(flights).fly()
            over = [
                FlownFlight(flights[one.flight], one.ending, None, one.log, keep_log)
                for one in ended
            ]
        flown |= zip((number for number, _ in group), over, strict=True)
        if progress:
            progress(len(flown))
    return [flown[number] for number in sorted(flown)]
