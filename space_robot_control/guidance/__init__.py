"""Guidance: quintic segments through waypoints, streamed in advance."""
