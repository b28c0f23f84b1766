"""knitstudy: how knitted textiles carry load, from yarn geometry to reduced order models."""

__version__ = "0.1.0"
