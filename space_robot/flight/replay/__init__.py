"""Replay: a recorded flight played to a live controller, with commands compared."""
