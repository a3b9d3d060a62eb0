"""The effects that are shipped: a file for each group, registered when it is imported."""
