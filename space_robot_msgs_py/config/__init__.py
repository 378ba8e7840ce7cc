"""Settings: one schema for files, parameters and options; strict reading of YAML."""
