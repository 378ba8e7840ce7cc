"""Many flights, and a verdict on all of them."""
