"""Sections of a scene: its keys by what they are about, each with unit, bounds, meaning, standing and source."""
