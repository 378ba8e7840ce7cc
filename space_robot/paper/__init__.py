"""Reproduction of the paper: Table V, its figures, and the stability proofs of Section III."""
