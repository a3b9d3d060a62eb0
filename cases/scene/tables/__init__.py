"""The tables of a scene, key by key: of the line, the train and the run."""
