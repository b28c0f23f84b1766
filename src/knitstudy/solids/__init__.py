"""Solid yarns: ties, contact between yarns, the direct numerical simulation. Nothing of beams."""
