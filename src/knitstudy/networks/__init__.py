"""Yarns as beams: reduced order models and beams in contact. Nothing of solids."""
