"""From a scene's tables to pantographs, their laws and the vehicle, in SI units."""
