"""The bench of a scenario: a flight step by step, whose result is that of a whole flight."""

from __future__ import annotations

from pathlib import Path

from ..flight.bench import FlightBench
from ..flight.ending import Ending
from .flown_flight import FlownFlight


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
