"""Python interface: scenarios, flown flights, and the bench for flights step by step."""

from ..flight.bench import Snapshot
from ..scenario.scenario import Scenario
from .bench import Bench
from .flown_flight import FlownFlight

__all__ = ["Bench", "FlownFlight", "Scenario", "Snapshot"]
