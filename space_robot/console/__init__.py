"""What commands show and write: tables, progress, streams, files."""
