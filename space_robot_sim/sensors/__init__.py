"""What is measured of the true state."""
