"""Reduced order models: the knit as a network of beams, in the plane (Fig. 4) and in space (Figs. 5, 6)."""
