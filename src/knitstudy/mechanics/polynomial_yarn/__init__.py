"""Yarns as solids that are polynomials over the section times splines along the yarn. No contact, no knits."""
