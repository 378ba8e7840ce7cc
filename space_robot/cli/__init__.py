"""Subcommands of ``space-robot``, one file each."""
