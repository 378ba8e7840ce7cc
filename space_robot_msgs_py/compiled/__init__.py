"""Compiled functions, their cache on disk, and the records that they share with Python."""
