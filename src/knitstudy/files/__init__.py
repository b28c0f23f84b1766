"""Files between stages: written whole or not at all, with provenance. Nothing that knows what is in them."""
