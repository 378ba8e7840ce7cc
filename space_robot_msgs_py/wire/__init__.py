"""The messages of the graph: laid out, encoded and decoded."""
