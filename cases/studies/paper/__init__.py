"""The study of a paper, as a table says it: runs under readings, statements, inputs ranked."""
