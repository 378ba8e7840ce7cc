"""Data sheets of hardware: key, unit, range, default and text of each number.

The simulation is built from one instance of a sheet, the flight software assumes another. The
record, the kernels and the faults of a component are in `space_robot_sim`.
"""
