"""Contacts and links in steps: places of heads on wires, dropper forces, response of the line."""
