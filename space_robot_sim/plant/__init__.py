"""The plant: the robot in its environment, stepped tick by tick."""
