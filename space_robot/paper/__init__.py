"""The paper flown again: Table V, its figures, and the proofs of its Section III."""
