"""A scenario with what carries it out, and its bench, whose result is that of a whole flight."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.errors import InputError

from ..console.progress import check_progress
from ..flight.bench import FlightBench
from ..flight.compilation import compile_kernels
from ..flight.ending import Ending
from ..flight.plan import Flight, resolve
from ..scenario.scenario import Scenario
from .flown_flight import FlownFlight, fly_in_process


class Bench(FlightBench):
    """A `FlightBench` that returns what was flown as `Scenario.fly` does."""

    def flown(self, bag: str | Path | None = None) -> FlownFlight:
        """Return the flight since the last `reset`: log, metrics, table, plots, outcome.

        Under the scenario's own law it has the bits of `Scenario.fly`. A flight under torques from
        outside has the law ``none``. The outcome of one that goes on is ``stopped``.

        Args:
            bag: folder to record to, which must not exist; None: none.

        Raises:
            InputError: see `log`; or the bag cannot be written.
        """
        flown = self._flown()
        ending = self._ending or Ending.stopped(self.tick, self.period)
        flight = FlownFlight(flown.flight, ending, None, flown.log)
        if bag is not None:
            flight.save(bag)
        return flight


class FlyableScenario(Scenario):
    """Definition of a flight: the options of ``space-robot simulate``, with the same defaults.

        Scenario(robot="paper", controller="tde_stc", case="3", sensors="fine", seed=1)

    An option that names a file may also be an object, or the content of the file:

    - ``robot``: a `Robot`, with the mission and gains of the shipped robot of the same name, if
      any; or the mapping of its file
    - ``plant_robot``: the robot of the plant, if it differs from that of controller and mission
    - ``controller``: a `ControlLaw` class or object; a function, see
      `space_robot_control.controller.law_choice`; None: none, for `bench`
    - ``gains``: values by gain, in place of the default set's: ``{"k_1": 3.0, "h_bar": [...]}``,
      one for all axes or n+3 (base x, y, z, joints); or such a mapping for each of several laws
    - ``mission``: a mission's document, ``{"start": ..., "segments": [...]}``, or
      `MissionSettings`. The flight begins at its start, or where the plant's parameters
      ``initial_joints_deg``, ``initial_quaternion`` and ``initial_rate_deg_s`` say
    - ``disturbance``: columns, numbers by name; or a function of time, sampled at 100 Hz
    - ``case``, ``sensors``, ``actuators``, ``orbit``: their settings, objects or mappings
    - ``assumed_actuators``: the base's actuators as assumed by the flight software
    - ``parameters``: any parameter of a node, ``{"plant": {"friction.coulomb": 0.0}}``

    The other options: ``duration`` s, ``period`` s, ``substeps``, ``navigation`` ("direct" or
    "filtered"), ``command_latency_ticks``, ``friction`` (False: none), ``faults``, ``events`` and
    ``swaps`` (lists of texts), ``seed``, ``compression`` and ``split_size`` of a bag; and those of
    ``space-robot fly``, which no flight in this process can have. A scenario is immutable and can
    be pickled; `replace` returns a modified one.
    """

    def __init__(self, **options: Any) -> None:
        """Store the options; one that is unknown, or of a wrong type, raises `InputError`."""
        super().__init__(**options)

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def check(self) -> Flight:
        """Resolve all names, and return the flight that would be flown.

        Raises:
            InputError: something does not exist, or does not fit the rest; in one line.
        """
        flight = Flight(resolve(self))
        flight.check_in_process()
        return flight

    def resolved(self) -> dict[str, Any]:
        """Return the same scenario with all numbers, independent of files.

        It consists of mappings, lists, numbers and texts: ``Scenario(**resolved)`` flies the same
        bits, and so does ``space-robot simulate --scenario`` with the mapping as a YAML file.

        Raises:
            InputError: see `check`.
        """
        return self.check().scenario.tree

    def fly(
        self,
        bag: str | Path | None = None,
        progress: Callable[[float], object] | bool | None = None,
        keep_log: bool = True,
    ) -> FlownFlight:
        """Fly in this process; the bits are those of ``simulate``, and of ``fly`` in lockstep.

        A diverged flight is a result, too: see `FlownFlight.outcome`. The first flight on a machine
        compiles the kernels. A start away from the mission's, with commands far above those of the
        mission, causes a `UserWarning`, and so does a mission that controls the attitude of a base
        without actuators.

        Args:
            bag: folder to record to, which must not exist.
            progress: called regularly with the simulated time, s; True: a progress line, in a
                terminal or a notebook.
            keep_log: False: only the metrics are kept. A log above 1 GB lies in files of the folder
                for temporary ones.

        Raises:
            InputError: see `check`; or the bag cannot be created, or there is no room for a log.
        """
        if self.controller is None:
            raise InputError("controller is None, so there is nothing to fly: use bench()")
        check_progress(progress)
        path, flight = None if bag is None else as_path(bag, "bag"), self.check()
        for remark in flight.remarks:
            warnings.warn(remark, stacklevel=2)
        return fly_in_process(flight, path, progress, keep_log)

    def bench(self, record: bool = True) -> Bench:
        """Return a bench at the flight's first tick.

        ``record``: keep the commands, for `Bench.log` and `Bench.flown`: half a microsecond and
        some 110 bytes a tick; 300 bytes more where the law is asked.
        """
        flight = self.check()
        compile_kernels(bool(flight.plant.names.actuators))
        return Bench(flight, record)
