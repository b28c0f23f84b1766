"""Decks of an endless fabric, of one square element to be copied into a model: its stiffness at rest, and its law."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from scipy.linalg import block_diag

from knitstudy.datasets import code_version
from knitstudy.errors import DataFileError
from knitstudy.files import write_text
from knitstudy.knit.scene.scene import Scene
from knitstudy.registry import find
from knitstudy.use.decks.inp import NUMBER, comment, lines
from knitstudy.use.fabric_law import forces_beside

SQUARE = """** Local 1 is the course direction, 2 the wale direction.
*NODE, NSET=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
*ELEMENT, TYPE={element}, ELSET=FABRIC
1, 1, 2, 3, 4
*ORIENTATION, NAME=COURSE
1., 0., 0., 0., 1., 0.
3, 0.
"""

# Stiffness of an endless knit at rest, as a shell section of Abaqus: of a tied cell, or from the numbers of a sheet

ROUNDING = 1e-10  # of the entries of a section, which are differences of stiffnesses of yarns

# The 21 entries of a symmetric section in their order: column by column, each down to the diagonal
SHELL_ENTRIES = tuple(f"D{row + 1}{column + 1}" for column in range(6) for row in range(column + 1))

SHELL = """*HEADING
{name}: an endless knit as a shell
** knitstudy {version}; m, N; the plane of reference is z = 0 of the loop.
** Strains e1, e2, g12 and curvatures k1, k2, k12 = 2 x twist; tension at z > 0 goes with k > 0.
** A Kirchhoff section: Abaqus estimates the transverse shear stiffness of a shear-flexible element itself.
{remarks}{square}** {entries}
*SHELL GENERAL SECTION, ELSET=FABRIC, ORIENTATION=COURSE
{data}
"""


def section_matrix(history: xr.Dataset) -> np.ndarray:
    """Return the stiffness (6, 6) of a cell at rest [N/m, N, N m], by e_x, e_y, g_xy, k_x, k_y, k_xy."""
    membrane, coupling, bending = (
        history[f"{name}_stiffness"].to_numpy() for name in ("membrane", "coupling", "bending")
    )
    return np.block([[membrane, coupling], [coupling.T, bending]])


def shell_entries(matrix: np.ndarray) -> np.ndarray:
    """Return the 21 numbers of a symmetric matrix (6, 6) in the order of `SHELL_ENTRIES`."""
    return np.concatenate([matrix[: column + 1, column] for column in range(6)])


def write_shell(scene: Scene, path: Path | str, history: xr.Dataset) -> None:
    """Write one square shell element with the section of a tied cell, to be copied into a model of Abaqus."""
    remark = comment("Yarns are tied where they cross: none slides.")
    _write_section(section_matrix(history), path, scene.name, remark)


def write_sliding(
    fitted: xr.Dataset, bending: tuple[float, float] | xr.Dataset, path: Path | str, title: str
) -> None:
    """Write that of yarns that slide, from a dataset of `use.fabric_law.membrane`.

    `bending` are stiffnesses [N m] of yarns that slide, in course and wale direction, or the history of a tied cell.
    """
    membrane = _linear_form(fitted)
    if isinstance(bending, xr.Dataset):
        block = bending["bending_stiffness"].to_numpy()
        known = "D44 to D66 are those of yarns that are tied where they cross, at their drawn loops"
    else:
        block = np.diag([*bending, 0.5 * float(np.sqrt(np.prod(bending)))])
        known = (
            "D44 and D55 are the slopes of its moments from 50 to 150 1/m; D45 is not known and 0 here; D66 is "
            "not known and estimated as sqrt(D44 D55) / 2, that of a plate which does not curve across"
        )
    remark = comment(
        f"NOT QUITE THE SECTION of yarns that slide. D11 to D33 are the linear law of the membrane; {known}. D14 to "
        "D36, bending with stretching, are not known and 0 here."
    )
    _write_section(block_diag(membrane, block), path, title, remark + _forces(fitted))


def _write_section(matrix: np.ndarray, path: Path | str, title: str, remark: str) -> None:
    size = np.sqrt(np.abs(np.diag(matrix)))  # stretching and bending have units of their own
    least = float(np.linalg.eigvalsh(matrix / np.outer(size, size))[0]) if np.all(size > 0) else 0.0
    if not least > ROUNDING:
        raise DataFileError(
            f"{title}: the section has no stiffness in one mode of stretching and bending (least eigenvalue "
            f"{least:.2g} of the matrix whose diagonal is 1), and no program can solve it"
        )
    data = lines((NUMBER % value for value in shell_entries(matrix)), 8).rstrip()
    values = {"name": title, "version": code_version(), "square": SQUARE.format(element="S4R")}
    values |= {"remarks": remark, "entries": ", ".join(SHELL_ENTRIES), "data": data}
    write_text(SHELL.format(**values), path)


# The linear law of a fabric as a membrane, exact for any thickness: stresses times thickness are forces per width.
# Abaqus has it as the limit b = A / c of Fung's law, c / 2 (exp(E . b E) - 1), for a large c; with b and c fitted the
# law of Fung is no nearer to cells (docs/notes/membrane.md). Its E is that of the distortion, which is the one in the
# plane for an incompressible material in plane stress, and there is no stress across. In CalculiX the modulus across
# couples with nothing, so that the thickness stays.

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


def _linear_form(fitted: xr.Dataset) -> np.ndarray:
    """Return the linear law (3, 3) [N/m] of a dataset of `use.fabric_law.membrane`, if it is one for decks."""
    if refused := fitted.attrs["refused"]:
        raise DataFileError(refused)
    form: np.ndarray = fitted["linear_form"].to_numpy()
    return form


def _forces(fitted: xr.Dataset) -> str:
    """Return comments: the states that the law is of, its least eigenvalue, and its forces beside those of the cell."""
    which = (
        "A SECANT, fitted to the states below alone: it holds at these strains, and at no others."
        if fitted.attrs["secant"]
        else "Fitted to all states of the cell. At smaller strains a fabric is softer than at the ends of its paths."
    )
    rows = [
        f"** {path}, {direction} {100 * strain:.4g} %: deck {deck:.4g} N/m, cell {cell:.4g} N/m\n"
        for path, direction, strain, deck, cell in forces_beside(fitted, "deck")
    ]
    ratio = f"Its least eigenvalue is {fitted.attrs['eigenvalues']:.2g} of the largest."
    return comment(f"{which} {ratio} Forces per width, free across where the cell is:") + "".join(rows)


def write_membrane(fitted: xr.Dataset, path: Path | str, dialect: str, title: str) -> None:
    """Write the linear law of a dataset of `use.fabric_law.membrane` for a program.

    Raises
    ------
    DataFileError
        If no linear law carries the forces of the cell.
    """
    keyword, template = find("deck dialect", LAWS, dialect)
    off = (
        "NOT QUITE THE LAW: E . A E / 2 of Green's strains E (11, 22, 2 x 12) that is nearest to the states of the "
        f"cell; {template}"
    )
    form = _linear_form(fitted) / THICKNESS
    largest = float(np.diag(form).max())
    if dialect == "abaqus":
        stiffness = STIFF * largest
        numbers = [*solid_entries(form / stiffness, across=0.0), stiffness, 0.0]  # of no volume change
    else:
        numbers = [*solid_entries(form, across=largest), 0.0]  # temperature
    text = DECK.format(
        title=title,
        version=code_version(),
        thickness=THICKNESS,
        remarks=comment(off) + _forces(fitted),
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
    solid[2, 2] = across
    solid[4, 4] = form[2, 2]
    solid[5, 5] = form[2, 2]
    return shell_entries(solid)
