"""A multibody pantograph: its data, reduced to tables, or with all its bodies."""
