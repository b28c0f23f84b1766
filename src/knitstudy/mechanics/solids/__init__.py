"""Solid elements: hexahedra and spline yarns."""
