"""A flight as a graph of nodes: processes started, watched, disturbed and stopped."""
