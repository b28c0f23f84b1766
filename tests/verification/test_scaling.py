"""A knit in other units of length and stress gives the same dimensionless answer in every model.

Powers of 2 scale without rounding: nothing but a hidden length, force or stiffness can show, and the last bits of sums,
whose order follows from where arrays lie in memory (3e-12 on one of several machines). Powers of 10 round inputs.
"""

from functools import cache

import numpy as np
import pytest

from knitstudy.run.configuration import load_scene
from knitstudy.run.store import simulate

KNIT = {"pattern.loops": 1, "load.strain": 0.005, "solver.increments": 2, "outputs": []}
TIED = KNIT | {"pattern.rows": 1}
SLIDING = KNIT | {"pattern.rows": 3, "load.stops": [], "solver.increments": 6}
BEAMS = {"mesh.beam_size": 1.5}
PRESSED = {"pair.length": 3.7e-3, "load.path": [[0, 0, -4e-5], [5e-5, 0, -4e-5]], "solver.increments": 4}
LOOSE = {"interaction": "isotropic", "contact.tied_edges": "none"}
FEW = {"gates.ledger": 1.0}  # so few increments are too coarse for its sums, which units do not concern

CASES = {
    "hexahedra, ties": ("dns-tie-course", TIED | {"mesh.size": 2 / 3}),
    "hexahedra, pair": (
        "pair-slid-90",
        PRESSED
        | FEW
        | {"mesh.size": 0.5, "gates.elements_across": 2.5, "gates.hourglass": 1.0, "gates.penalty": 1.0},
    ),
    "spline yarns, ties": ("yarns-tie-course", TIED),
    "spline yarns, friction": ("yarns-isotropic-course", SLIDING),
    "spline yarns, pair": (
        "pair-slid-90",
        # Balanced to the default 1e-6, answers differ by up to 1.2e-9 where iterations end.
        PRESSED | {"fidelity": "spline_yarns", "pair.support": "ends", "solver.residual_tolerance": 1e-8},
    ),
    "3D network": ("rom3d-tie-course", TIED | BEAMS | {"rom.contacts_from": None}),
    "3D network, patches": (
        "rom3d-tie-course",
        TIED | BEAMS | {"rom.contacts_from": None, "rom.joint": "patch"},
    ),
    "2D network": ("rom2d-tie-course", TIED | {"rom.contacts_from": None}),
    "beams, rigid": ("beam-isotropic-course", SLIDING | BEAMS),
    "beams, Hertz": (
        "beam-isotropic-course",
        SLIDING | BEAMS | {"beam.section": "hertz", "beam.tie": "patch"},
    ),
    "endless cell, ties": ("cell-course", TIED),
    "endless cell, friction": (
        "cell-course",
        # As for the pair above: 1.4e-9 where iterations end by the default tolerance
        TIED | LOOSE | FEW | {"solver.increments": 6, "solver.residual_tolerance": 1e-8},
    ),
}

BINARY = {"mm": (2.0**-10, 2.0**20), "km": (2.0**10, 2.0**-20)}
DECIMAL = {"mm, 10": (1e-3, 1e6), "km, 10": (1e3, 1e-6)}


@cache
def curve(case, length=1.0, stiffness=1.0):
    """Return the force over E R^2 and the displacement over R of the centrelines."""
    name, changes = CASES[case]
    scene = load_scene(name).vary(changes).scaled(length=length, stiffness=stiffness)
    history = simulate(scene).history
    unit = scene.yarn.youngs_modulus * scene.yarn.radius**2
    return history["force"].to_numpy() / unit, history[
        "centreline_displacement"
    ].to_numpy() / scene.yarn.radius


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("units", [*BINARY, *DECIMAL])
def test_units_leave_the_dimensionless_answer_alone(case, units, full, verify):
    if not full and units != "mm":
        pytest.skip("takes --full")
    for message, here, there in zip(
        ("force", "motion"), curve(case, *(BINARY | DECIMAL)[units]), curve(case), strict=True
    ):
        error = np.abs(here - there).max() / np.abs(there).max()
        verify.at_most(f"units: {units}: {case}: {message}", error, 1e-10 if units in BINARY else 1e-9)
