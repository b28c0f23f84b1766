"""Figures of the paper and of this study, one file each; a figure registers itself in `catalogue`."""
