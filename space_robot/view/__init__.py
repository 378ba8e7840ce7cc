"""Flights to be looked at: a robot in 3-D with plots that follow it, as a page or live."""
