"""Stages: their inputs and results, and which results are up to date. No physics."""
