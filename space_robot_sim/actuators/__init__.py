"""What turns commands into torques."""
