"""Python interface: scenarios, flown flights, and the bench for flights step by step."""

from ..flight.bench import Snapshot
from .flown_flight import FlownFlight
from .scenario import Bench
from .scenario import FlyableScenario as Scenario

__all__ = ["Bench", "FlownFlight", "Scenario", "Snapshot"]
