"""Subcommands of ``space-robot`` with a file of their own."""
