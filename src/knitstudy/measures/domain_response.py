"""What a square knit answers at full load, so that knits of different size can be compared: what of them is edge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import xarray as xr

from knitstudy.measures.domain import force_per_width
from knitstudy.measures.quantities import NORMAL, QUANTITIES
from knitstudy.measures.response import largest_out_of_plane
from knitstudy.study.scene import Scene


@dataclass(frozen=True)
class DomainResponse:
    """At full load: force over the width [N/m], largest |u_z| [m], mean normal force in the centre cell [N] or nan."""

    force: float
    out_of_plane: float
    normal: float


def domain_response(
    scene: Scene, histories: Mapping[str, xr.Dataset], contacts: Mapping[str, xr.Dataset]
) -> DomainResponse:
    """Return the response of a scene; `contacts` are those of direct simulations."""
    history = histories[scene.name]
    normal = nan
    if scene.name in contacts:
        _, values = QUANTITIES[NORMAL]
        normal = float(values(history, contacts[scene.name])[-1])
    return DomainResponse(force_per_width(history, scene), largest_out_of_plane(history), normal)
