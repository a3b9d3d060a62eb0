"""Regulated lifts: controllers that change a pantograph's static force under way."""
