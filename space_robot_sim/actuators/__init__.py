"""What turns commands into torques: delay, limits."""
