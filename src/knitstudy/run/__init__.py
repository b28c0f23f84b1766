"""Scenes of a study and their results: families, stages, digests, the plan, the store, advice, commands. No physics."""
