"""Export of a scenario's flight software as a folder of C, with recorded flights to accept it."""
