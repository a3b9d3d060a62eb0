"""Files of results: their layout, and how they are kept whole."""
