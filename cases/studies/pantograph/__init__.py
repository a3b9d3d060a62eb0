"""Frequency response and lumped model of a pantograph."""
