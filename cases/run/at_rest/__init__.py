"""Tables of a scene's line at rest, without a march: heights, droppers, temperatures."""
