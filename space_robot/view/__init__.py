"""3-D views of flights with synchronised plots, as a page or live."""
