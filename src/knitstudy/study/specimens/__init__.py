"""Specimens, one file each: what there is to be simulated, and which keys describe it."""
