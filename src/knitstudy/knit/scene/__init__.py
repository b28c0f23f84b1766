"""Scenes: their keys, the kinds of scenes, stitches, yarns as files. No mechanics."""
