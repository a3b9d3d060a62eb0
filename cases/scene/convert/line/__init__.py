"""From a scene's tables to the line, its ends, its defects and the wind, in SI units."""
