"""Start, end and identify processes."""
