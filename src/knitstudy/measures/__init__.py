"""Measures of histories: numbers with an uncertainty, without drawing or writing."""
