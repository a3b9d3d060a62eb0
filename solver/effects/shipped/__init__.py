"""The effects that are shipped: tables of them by subject, registered by `all_effects.py`."""
