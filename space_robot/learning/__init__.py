"""Tasks for learning: environments of Gymnasium, one at a time and many in lanes."""
