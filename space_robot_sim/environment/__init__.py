"""What acts on the robot besides its actuators: friction, disturbances, payload."""
