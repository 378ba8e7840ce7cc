"""What is measured of the true state, and how measurements go wrong."""
