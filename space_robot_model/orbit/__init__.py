"""Orbit of the reference point: elements, gravity, and flight software's own propagation."""
