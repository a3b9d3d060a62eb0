"""How the vehicle moves the pantographs' bases."""
