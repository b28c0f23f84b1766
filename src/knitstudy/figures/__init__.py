"""Figures of the paper, one module each: ``draw(**datasets) -> matplotlib Figure``. See `catalogue`."""
