"""Data sheets of hardware.

The simulation builds its hardware from them; flight software has separate instances.
"""
