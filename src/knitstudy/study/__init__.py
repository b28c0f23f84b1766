"""Scenes: their keys, their families, and the choice of a model for a question. No mechanics."""
