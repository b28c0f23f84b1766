"""Yarns that are tied where they cross."""

from knitstudy.study.kinds import INTERACTIONS, Interaction

INTERACTIONS.register(Interaction("tie", "no motion where yarns cross", friction=None))
