"""The scene: everything that a run is made of, as written in case.toml."""
