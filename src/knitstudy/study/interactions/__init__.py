"""Interactions between yarns, one file each (section 2.2 of the paper)."""
