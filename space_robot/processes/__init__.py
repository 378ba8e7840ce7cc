"""Processes: what starts them, ends them, and says which software runs in them."""
