"""The law of a fabric as a membrane of Abaqus or CalculiX: one square element, to be copied into a model.

Both laws are exact for a membrane of any thickness: stresses times thickness are forces per width. Fung's law of Abaqus
has Green's strain of the distortion, which of an incompressible material in plane stress is that in the plane, and no
stress across. Of CalculiX's linear law the modulus across couples with nothing, so that the thickness stays.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.exchange.inp import COMMENT, NUMBER, lines
from knitstudy.files import code_version, write_text

THICKNESS = 1e-3  # m, of the element; forces do not depend on it

# What each program has of the laws, by dialect: the law, its keyword, and how it differs
FORMS = {
    "abaqus": (
        "fung",
        "*ANISOTROPIC HYPERELASTIC, FUNG-ANISOTROPIC",
        "Fung's law, c / 2 (exp(E . b E) - 1) of Green's strains E (11, 22, 2 x 12), is nearest to the states of the "
        "cell; that of exponentials is nearer, for which Abaqus has user subroutines alone (UANISOHYPER_STRAIN)",
    ),
    "calculix": (
        "linear",
        "*ELASTIC, TYPE=ANISO",
        "a linear law of Green's strains is nearest to the states of the cell: CalculiX has no hyperelastic law "
        "that is anisotropic but for fibres in an isotropic body. Under NLGEOM *ELASTIC is linear in these strains",
    ),
}

DECK = """*HEADING
{title}: an endless fabric as a membrane
** knitstudy {version}; m, N, Pa; forces per width are stresses times the thickness of {thickness:g} m
{said}** Local 1 is the course direction, 2 the wale direction. A membrane has no bending stiffness.
*NODE, NSET=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
*ELEMENT, TYPE=M3D4, ELSET=FABRIC
1, 1, 2, 3, 4
*ORIENTATION, NAME=COURSE
1., 0., 0., 0., 1., 0.
*MATERIAL, NAME=FABRIC
{keyword}
{data}*MEMBRANE SECTION, ELSET=FABRIC, MATERIAL=FABRIC, ORIENTATION=COURSE
{thickness:g}
"""


def write_membrane(fitted: xr.Dataset, path: Path | str, dialect: str, title: str) -> None:
    """Write the law that a program has, of those in a dataset of `measures.membrane_fit.membrane`."""
    if dialect not in FORMS:
        raise ConfigurationError(f"unknown deck dialect {dialect!r}; allowed are {', '.join(FORMS)}")
    law, keyword, said = FORMS[dialect]
    off = (
        f"NOT QUITE THE LAW: {said}. Forces are {100 * fitted.attrs[f'{law}_error']:.2g} % off the cell "
        f"(root mean square over all states), those of exponentials {100 * fitted.attrs['error']:.2g} %"
    )
    form = fitted[f"{law}_form"].to_numpy()
    if law == "fung":
        stiffness = fitted["fung_stiffness"].item() / THICKNESS
        numbers = [*solid_entries(form, across=0.0), stiffness, 0.0]  # of no volume change
    else:
        form = form / THICKNESS
        numbers = [*solid_entries(form, across=float(np.diag(form).max())), 0.0]  # temperature
    comment = "".join(f"** {line}\n" for line in textwrap.wrap(off, COMMENT, break_on_hyphens=False))
    text = DECK.format(
        title=title,
        version=code_version(),
        thickness=THICKNESS,
        said=comment,
        keyword=keyword,
        data=lines((NUMBER % each for each in numbers), 8),
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
    return np.concatenate([solid[: column + 1, column] for column in range(6)])
