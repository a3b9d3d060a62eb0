"""Keys of a scene: tables, units, usual values, and sentences about wrong ones."""
