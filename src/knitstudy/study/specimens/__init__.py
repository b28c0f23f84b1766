"""Specimens, one file each."""
