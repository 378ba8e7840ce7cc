"""What acts on the robot besides its actuators."""
