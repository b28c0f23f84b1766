"""Fig. 15: reaction force against strain of the three models, of the DNS on two meshes, and of the variants."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from knitstudy.figures.catalogue import FIGURES
from knitstudy.figures.curves import (
    PERCENT,
    Curve,
    draw_legend_below,
    figure_over_legend,
    name_ends,
    stiffness_ratio,
    strain_label,
)
from knitstudy.figures.style import FAINT, MODELS, OTHER, styled
from knitstudy.measures.cases import label_of
from knitstudy.measures.selection import ISOTROPIC_COURSE, ISOTROPIC_WALE, TIED_COURSE, TIED_WALE
from knitstudy.study.scene import Scene

DASHES = ((0, (1, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (2, 2.5)), (0, (3, 1, 1, 1, 1, 1)))
"""Of the variants of one model, in their order."""


@FIGURES.add(
    "fig15a_force_strain",
    "Fig. 15a: force against strain in course direction, ties",
    needs=("dns", "rom3d", "rom2d", "scenes"),
    of=TIED_COURSE,
    optional=("other_mesh", "reduced"),
    order=1,
)
@FIGURES.add(
    "fig15b_force_strain",
    "Fig. 15b: force against strain in wale direction, ties",
    needs=("dns", "rom3d", "rom2d", "scenes"),
    of=TIED_WALE,
    optional=("other_mesh", "reduced"),
    order=2,
)
@FIGURES.add(
    "fig15c_force_strain",
    "Fig. 15c: force against strain in course direction, isotropic friction",
    needs=("dns", "rom3d", "rom2d", "scenes"),
    of=ISOTROPIC_COURSE,
    optional=("other_mesh", "reduced"),
    order=3,
)
@FIGURES.add(
    "fig15d_force_strain",
    "Fig. 15d: force against strain in wale direction, isotropic friction",
    needs=("dns", "rom3d", "rom2d", "scenes"),
    of=ISOTROPIC_WALE,
    optional=("other_mesh", "reduced"),
    order=4,
)
@styled
def draw(
    dns: xr.Dataset,
    rom3d: xr.Dataset,
    rom2d: xr.Dataset,
    scenes: Mapping[str, Scene],
    other_mesh: xr.Dataset | None = None,
    reduced: Mapping[str, xr.Dataset] | None = None,
) -> Figure:
    """Draw force against strain; the legend gives secant stiffnesses over the one of the DNS.

    Parameters
    ----------
    dns, rom3d, rom2d : Dataset
        Histories (see docs/architecture.md).
    scenes : mapping of str to Scene
        Their scenes by fidelity, "other_mesh" and those of `reduced` by name.
    other_mesh : Dataset, optional
        History of the same DNS on another mesh.
    reduced : mapping of str to Dataset, optional
        Histories of all reduced models by scene, of which the variants are drawn.
    """
    models = {"dns": dns, "rom3d": rom3d, "rom2d": rom2d}
    main = {scenes[fidelity].name for fidelity in models}
    variants = {name: each for name, each in (reduced or {}).items() if name not in main}
    drawing, axes = figure_over_legend(len(models) + (other_mesh is not None) + len(variants))
    if other_mesh is not None:
        _draw_band(axes, dns, other_mesh, [scenes[role].mesh.size for role in ("dns", "other_mesh")])
    for fidelity, history in models.items():
        look = MODELS[fidelity]
        text = look.label if fidelity == "dns" else f"{look.label} {stiffness_ratio(history, dns)}"
        axes.plot(PERCENT * history["strain"], history["force"], label=text, clip_on=False, **look.line)
    _draw_variants(axes, variants, dns, scenes)
    everything = [*models.values(), *variants.values()]
    axes.set(xlabel=strain_label(scenes["dns"].load.direction), ylabel="reaction force (N)")
    axes.set_xlim(0, PERCENT * max(float(history["strain"].max()) for history in everything))
    axes.set_ylim(0, None)
    draw_legend_below(drawing)
    name_ends(
        axes,
        [Curve(MODELS[fidelity], each["strain"], each["force"]) for fidelity, each in models.items()],
        "N",
    )
    return drawing


def _draw_band(axes: Axes, dns: xr.Dataset, other_mesh: xr.Dataset, sizes: list[float]) -> None:
    """Fill what lies between the forces of the DNS on two meshes, as far as both reach."""
    end = min(float(dns["strain"][-1]), float(other_mesh["strain"][-1]))
    strain = np.union1d(dns["strain"], other_mesh["strain"])
    strain = strain[strain <= end]
    forces = [np.interp(strain, each["strain"], each["force"]) for each in (dns, other_mesh)]
    fine, coarse = sorted(1e3 * size for size in sizes)
    text = f"DNS, elements of {fine:.2f} to {coarse:.2f} mm"
    axes.fill_between(PERCENT * strain, *forces, color=FAINT, alpha=0.6, linewidth=0, label=text)


def _draw_variants(
    axes: Axes, variants: Mapping[str, xr.Dataset], dns: xr.Dataset, scenes: Mapping[str, Scene]
) -> None:
    """Draw thin lines in the colours of the models that they are variants of."""
    drawn: Counter[str] = Counter()
    for name, history in variants.items():
        fidelity = scenes[name].fidelity
        axes.plot(
            PERCENT * history["strain"],
            history["force"],
            color=MODELS.get(fidelity, OTHER).colour,
            linestyle=DASHES[drawn[fidelity] % len(DASHES)],
            linewidth=0.9,
            label=f"{label_of(scenes[name])} {stiffness_ratio(history, dns)}",
            zorder=1.5,
        )
        drawn[fidelity] += 1
