"""The description of a flight: its options, and the settings of every node made from them."""
