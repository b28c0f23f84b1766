"""Spline yarns: polynomials over the section times B-splines along the yarn."""
