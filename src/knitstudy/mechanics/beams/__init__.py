"""Yarns as beams: elements, sections of bent rods, and contact of beams along their length."""
