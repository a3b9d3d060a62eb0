"""Files of results: what they hold of a run, their layout, and how they are kept whole."""
