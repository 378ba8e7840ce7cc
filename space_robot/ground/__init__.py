"""Ground display: telemetry packets, decoded by their database, on a page of NASA's Open MCT."""
