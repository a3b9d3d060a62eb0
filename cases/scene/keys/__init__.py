"""Keys of a scene: which there are, their usual values, and sentences about wrong ones."""
