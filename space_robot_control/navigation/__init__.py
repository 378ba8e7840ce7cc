"""Navigation: from what the sensors report to an estimate of the state."""
