"""Python interface: scenarios, flown flights, and the bench for flights step by step."""

from ..flight.bench import Snapshot
from .bench import Bench
from .flown_flight import FlownFlight
from .scenario import Scenario

__all__ = ["Bench", "FlownFlight", "Scenario", "Snapshot"]
