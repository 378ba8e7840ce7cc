"""Environment of the robot: friction, disturbances, payload, captures."""
