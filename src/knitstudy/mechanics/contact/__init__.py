"""Interactions between yarns at their crossings."""
