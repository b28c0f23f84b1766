"""The linear law of a fabric as a membrane of Abaqus or CalculiX: one square element, to be copied into a model.

The law is exact for a membrane of any thickness: stresses times thickness are forces per width. Abaqus has it as the
limit b = A / c of Fung's law, c / 2 (exp(E . b E) - 1), for a large c; with b and c fitted Fung's law is no nearer to
cells (docs/notes/membrane.md). Its E is that of the distortion, which of an incompressible material in plane stress is
the one in the plane, and there is no stress across. In CalculiX the modulus across couples with nothing, so that the
thickness stays.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.files import code_version, write_text
from knitstudy.use.inp import COMMENT, NUMBER, SQUARE, lines, shell_entries

THICKNESS = 1e-3  # m, of the element; forces do not depend on it

STIFF = 1e4  # c over the largest entry of A: forces deviate from the linear law by E . E / STIFF

# By dialect: the keyword of the law, and why it is not the nearer one
LAWS = {
    "abaqus": (
        "*ANISOTROPIC HYPERELASTIC, FUNG-ANISOTROPIC",
        "Abaqus has that of exponentials in user subroutines alone (UANISOHYPER_STRAIN)",
    ),
    "calculix": (
        "*ELASTIC, TYPE=ANISO",
        "CalculiX has no hyperelastic law that is anisotropic but for fibres in an isotropic body. Under NLGEOM "
        "*ELASTIC is linear in Green's strains",
    ),
}

DECK = """*HEADING
{title}: an endless fabric as a membrane
** knitstudy {version}; m, N, Pa; forces per width are stresses times the thickness of {thickness:g} m
{remarks}** A membrane has no bending stiffness.
{square}*MATERIAL, NAME=FABRIC
{keyword}
{data}*MEMBRANE SECTION, ELSET=FABRIC, MATERIAL=FABRIC, ORIENTATION=COURSE
{thickness:g}
"""


def write_membrane(fitted: xr.Dataset, path: Path | str, dialect: str, title: str) -> None:
    """Write the linear law of a dataset of `use.membrane_fit.membrane` for a program."""
    if dialect not in LAWS:
        raise ConfigurationError(f"unknown deck dialect {dialect!r}; allowed are {', '.join(LAWS)}")
    keyword, template = LAWS[dialect]
    off = (
        "NOT QUITE THE LAW: E . A E / 2 of Green's strains E (11, 22, 2 x 12) that is nearest to the states of the "
        f"cell. Forces are {100 * fitted.attrs['linear_error']:.2g} % off the cell (root mean square over all "
        f"states), forces of the law of exponentials {100 * fitted.attrs['error']:.2g} %; {template}"
    )
    form = fitted["linear_form"].to_numpy() / THICKNESS
    largest = float(np.diag(form).max())
    if dialect == "abaqus":
        stiffness = STIFF * largest
        numbers = [*solid_entries(form / stiffness, across=0.0), stiffness, 0.0]  # of no volume change
    else:
        numbers = [*solid_entries(form, across=largest), 0.0]  # temperature
    comment = "".join(f"** {line}\n" for line in textwrap.wrap(off, COMMENT, break_on_hyphens=False))
    text = DECK.format(
        title=title,
        version=code_version(),
        thickness=THICKNESS,
        remarks=comment,
        square=SQUARE.format(element="M3D4"),
        keyword=keyword,
        data=lines((NUMBER % number for number in numbers), 8),
    )
    write_text(text, path)


def solid_entries(form: np.ndarray, across: float) -> np.ndarray:
    """Return the 21 entries of a solid's form from that (3, 3) of its plane, in the order of both programs.

    The order is column by column, each down to the diagonal, of 11, 22, 33, 12, 13, 23: 1111, 1122, 2222, 1133 and so
    on. Across the plane there is `across` alone, and shear with the stiffness of that in the plane.
    """
    solid = np.zeros((6, 6))
    plane = [0, 1, 3]
    solid[np.ix_(plane, plane)] = form
    solid[2, 2], solid[4, 4], solid[5, 5] = across, form[2, 2], form[2, 2]
    return shell_entries(solid)
