"""The tables of a scene, key by key."""
