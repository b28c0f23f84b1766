"""Cells of endless fabrics: lattices, and what repeats itself by them."""
