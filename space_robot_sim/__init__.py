"""Simulation of the robot: all that flight software does not know.

A component (sensor, actuator, drive, effect of the environment) is one file: a record whose fields
say where their numbers are from (`space_robot_sim.component`), a table of its faults, its kernels.
Data sheets that flight software assumes, too, are in `space_robot_model.hardware`.

`faults` has their text form, their schedule, and those of messages; `environment`, `actuators` and
`sensors` have the components; `plant` steps all of them by a tick, with the node around it.
Nothing here imports `space_robot_control`, nor the other way round.
"""
