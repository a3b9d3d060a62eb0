"""From a scene's tables to lines, pantographs and problems in SI units."""
