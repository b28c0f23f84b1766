"""Figures, one function each that registers itself in `catalogue`, and what draws them. No table, no simulation."""
