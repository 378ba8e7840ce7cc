"""Flying: one plan, in this process (`simulate`) or as a graph of nodes (`orchestrator`)."""
