"""What the direct simulation with friction stands on, as `simulation` says it of ties."""

from knitstudy.tables.simulation import build

__all__ = ["build"]
