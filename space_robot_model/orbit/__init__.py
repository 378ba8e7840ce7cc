"""Orbit of the reference point: elements, gravity, and the propagation that flight software uses."""
