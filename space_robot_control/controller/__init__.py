"""Controller: tracking errors, time-delay estimate, laws and supervision."""
