"""Keys of the train: pantographs, their mechanisms, the vehicle."""
