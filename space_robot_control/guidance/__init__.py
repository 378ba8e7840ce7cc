"""The desired motion: quintic segments through waypoints, streamed ahead of need."""
