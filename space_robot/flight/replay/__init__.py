"""Replay: recorded states answered anew, with commands compared."""
