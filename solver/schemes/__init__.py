"""Ways through one step, and steps that adapt."""
