"""Fidelities, one file each: which models there are, and which keys each of them has."""
