"""Allocation: the torque that a law asks of the base, shared out to wheels and thrusters."""
