"""Data sheets of hardware.

The simulation builds hardware from them; flight software assumes other instances of the same.
"""
