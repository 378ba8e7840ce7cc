"""The controller: tracking errors, time-delay estimate, laws and their supervision."""
