"""What models and interactions are called in figures and tables."""

from __future__ import annotations

NAMES = {"dns": "DNS", "rom3d": "3D ROM", "rom2d": "2D ROM", "beam": "beams", "window": "window"}
"""What models are called in figures and tables, by fidelity."""

INTERACTIONS = {"tie": "tie constraint", "rough": "rough contact", "isotropic": "isotropic friction"}
"""What interactions are called in figures and tables."""
