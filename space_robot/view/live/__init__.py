"""Live scene of a running flight."""
