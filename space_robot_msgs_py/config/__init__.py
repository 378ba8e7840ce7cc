"""Settings: one schema for files, parameters and options; YAML that is read strictly."""
