"""Output of commands: tables, progress, standard streams, files."""
