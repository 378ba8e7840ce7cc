"""Compiled functions, their cache on disk, and records shared by compiled code and Python."""
