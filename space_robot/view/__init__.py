"""Views of flights: a robot in 3-D with synchronised plots, as a page or live."""
