"""Messages of the graph: descriptions, layouts, encoding and decoding."""
