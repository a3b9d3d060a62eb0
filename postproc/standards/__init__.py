"""Rule books: the criteria of standards as data, and the quantities that they limit."""
