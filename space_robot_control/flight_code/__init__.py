"""Export of the flight software as C99 that computes the same bits."""
