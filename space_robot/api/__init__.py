"""Flights from Python: a scenario, the flight that it makes, and the bench to fly step by step."""

from ..flight.bench import Bench, Snapshot
from .flown_flight import FlownFlight
from .scenario import Scenario

__all__ = ["Bench", "FlownFlight", "Scenario", "Snapshot"]
