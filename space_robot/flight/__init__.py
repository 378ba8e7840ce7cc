"""Flights of a scenario: in this process (`simulate`) or as ROS nodes (`orchestrator`)."""
