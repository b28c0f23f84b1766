"""Spline yarns: polynomials over the section times B-splines along the yarn."""

LARGEST_DEGREE = 12  # beyond it nothing has been verified, and a span costs more than the spans that it saves
