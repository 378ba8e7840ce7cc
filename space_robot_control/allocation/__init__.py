"""Allocation of the commanded base torque to wheels and thrusters."""
