"""Motion of the pantographs' bases by the vehicle."""
