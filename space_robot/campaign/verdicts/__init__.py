"""Statistics of a campaign's table: verdicts on requirements, comparison of laws, sensitivity."""
