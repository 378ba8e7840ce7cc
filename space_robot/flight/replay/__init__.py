"""A recorded flight played again to a live controller, its commands compared with the recorded."""
