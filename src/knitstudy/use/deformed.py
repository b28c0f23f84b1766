"""A deformed knit of any model: a picture, an animation over the load path, and a page that turns in a browser.

All models record the displacement of centrelines at every increment: yarns are drawn as tubes about these. Solids with
the output ``fields`` hold stresses and contact pressures of their surface at full load as well. A cell is drawn three
times in both directions.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from knitstudy.errors import ConfigurationError, DataFileError
from knitstudy.files import replacing, write_text
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.loading.run import ReportProgress, silent
from knitstudy.measures.response import motion
from knitstudy.mechanics.core.arrays import Floats
from knitstudy.registry import naming_extra
from knitstudy.use.solids import (
    BAR,
    FRONT,
    Picture,
    Surface,
    View,
    bounds,
    colour_bar,
    draw_rows,
    scale_bar,
    tube,
)
from knitstudy.use.style import MILLIMETRE, SINGLE, YARNS, pixels, resolution, save, styled
from knitstudy.use.vtu import SHIFTED

if TYPE_CHECKING:
    from meshio import Mesh

VIEW = FRONT  # lengths in the plane of the fabric are true
COLOURS = colormaps["viridis"]
WIDTH = "cell_width"  # attribute of histories of cells of beams
COPIES = 3  # Copies of a cell in either direction
BELOW = 0.17  # Room for the scale and the axes below a knit, over its width
NEAR = 1.5  # Distance along a yarn from a crossing up to which a colour is that of the crossing, in radii
PAUSE = 180  # Time for which a picture of an animation stands [ms]
PRESSED = 0.01  # Least contact pressure of opaque facets, over the largest
FRAMES = 24  # Most pictures of an animation

# Variable of the crossings, label and scale of a colour of crossings, by name.
CROSSINGS = {
    "slip": ("crossing_slip", "slip at crossings (mm)", MILLIMETRE),
    "force": ("crossing_force", "force at crossings (N)", 1.0),
}
# Field of nodes, label and scale of a colour of solids at full load, by name.
FIELDS = {
    "stress": ("von_mises [Pa]", "von Mises stress (MPa)", 1e-6),
    "pressure": ("contact_pressure [Pa]", "contact pressure (MPa)", 1e-6),
}
NAMES = ("u_z", *CROSSINGS, *FIELDS)


@dataclass(frozen=True, eq=False)
class Deformed:
    """Surfaces of a knit at some increments, with a value at every corner."""

    points: np.ndarray  # (T, P, 3) corners [m]
    faces: np.ndarray  # (F, 4) corners of the facets
    values: np.ndarray  # (T, P)
    label: str  # of the values, with their unit
    history: xr.Dataset  # that holds these increments
    # (2, 3) vectors by which the undeformed fabric repeats itself, of a cell [m]
    cell: np.ndarray | None = None

    @property
    def strain(self) -> np.ndarray:
        """Strains (T,) of the increments: all of the history, or the last one."""
        return self.history["strain"].to_numpy()[-len(self.values) :]

    @property
    def scale(self) -> ScalarMappable:
        """Colours of the values, the same at all increments."""
        low, high = float(np.nanmin(self.values)), float(np.nanmax(self.values))
        return ScalarMappable(Normalize(low, high if high > low else low + 1.0), COLOURS)


def deformed(
    geometry: xr.Dataset,
    history: xr.Dataset,
    radius: Floats | float,
    colour: str = "u_z",
    solids: Callable[[], Mesh] | None = None,
) -> Deformed:
    """Return the deformed yarns of a history, coloured by one of `NAMES`.

    Parameters
    ----------
    geometry : Dataset
        Undeformed yarns, the result of the stage geometry.
    history : Dataset
        History of any model.
    radius : float or array
        Radius of the yarns, or of each of them (Y,) [m].
    colour : str
        "u_z" [mm], "slip" [mm] or "force" [N] of crossings at all increments; "stress" or "pressure" [MPa] of solids at
        full load.
    solids : callable, optional
        Returns the solids of the history (`knitstudy.use.vtu.solids`), for the colours of `FIELDS`.

    Raises
    ------
    ConfigurationError
        When there is no such colour, or the history does not hold its values.
    """
    if colour not in NAMES:
        raise ConfigurationError(f"colour is {colour!r} but must be one of {', '.join(NAMES)}")
    fabric = fabric_of(geometry)
    place = history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()
    course, wale = _lattice(fabric, history, place)
    copies = COPIES if len(fabric.periods) else 1
    cell = np.stack([course[0], wale[0]]) if len(fabric.periods) else None
    if colour in FIELDS:
        if solids is None:
            raise ConfigurationError(
                f"colour is {colour!r} but no solids are given: see knitstudy.use.vtu.solids"
            )
        solid = _surface_of(solids(), history, colour)
        return replace(_repeated(_repeated(solid, course[-1:], copies), wale[-1:], copies), cell=cell)
    values, label = _of_stations(fabric, history, colour)
    yarn = history["yarn"].to_numpy()
    radii = np.broadcast_to(radius, yarn.max() + 1)
    points = []
    faces = []
    at = []
    first = 0
    for number in np.unique(yarn):
        own = np.flatnonzero(yarn == number)
        # A yarn of a cell goes on where it ends: at the image of its first station, which histories of beams leave out
        if WIDTH in history.attrs:
            own = np.append(own, own[0])
        along = np.append(np.tile(own[:-1], copies), own[-1])
        copy = np.append(np.repeat(np.arange(copies), len(own) - 1), copies - 1 + (WIDTH in history.attrs))
        lines = place[:, along] + copy[:, None] * course[:, None]
        tubes = [tube(line, radii[number], "") for line in lines]
        points.append(np.stack([tube.points for tube in tubes]))
        faces.append(tubes[0].faces + first)
        first += len(tubes[0].points)
        around = len(tubes[0].points) // (len(along) + 2)
        at.append(np.repeat(np.concatenate([along[:1], along, along[-1:]]), around))
    rows = Deformed(
        np.concatenate(points, axis=1), np.concatenate(faces), values[:, np.concatenate(at)], label, history
    )
    return replace(_repeated(rows, wale, copies), cell=cell)


def _of_stations(fabric: Fabric, history: xr.Dataset, colour: str) -> tuple[np.ndarray, str]:
    """Return values (T, S) at the stations of the centrelines, and their label."""
    if colour == "u_z":
        return MILLIMETRE * motion(history)[:, :, 2], "out-of-plane displacement (mm)"
    name, label, scale = CROSSINGS[colour]
    if name not in history:
        held = [quantity for quantity, (variable, *_) in CROSSINGS.items() if variable in history]
        raise ConfigurationError(
            f"colour is {colour!r} but the history holds only {', '.join(['u_z', *held])}"
        )
    at_crossings = history[name].to_numpy()
    sizes = at_crossings if at_crossings.ndim == 2 else np.linalg.norm(at_crossings, axis=-1)
    strength = scale * np.nan_to_num(sizes)
    yarn, s = history["yarn"].to_numpy(), history["arc_length"].to_numpy()
    crossings = fabric.crossings
    values = np.zeros((len(strength), len(yarn)))
    for side in (0, 1):
        apart = np.abs(s[None] - crossings.arc_length[:, side, None])
        near = (crossings.yarn[:, side, None] == yarn) & (apart <= NEAR * fabric.radius)
        for crossing, stations in enumerate(near):
            values[:, stations] = np.maximum(values[:, stations], strength[:, crossing, None])
    return values, label


def _lattice(fabric: Fabric, history: xr.Dataset, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vectors (T, 3) [m] along courses and wales by which a cell repeats itself; 0 of other specimens.

    `place` (T, S, 3) are the stations of the centrelines. The centreline of a yarn begins and ends at images of one
    point, which gives the vector along the courses; histories of beams leave out the last image, and have the width.
    The vector along the wales follows from the strains of the cell and its length where the load path began: of beams
    an attribute of the history, since their cell may start from its shape at rest.
    """
    if not len(fabric.periods):
        return np.zeros((len(place), 3)), np.zeros((len(place), 3))
    own = np.flatnonzero(history["yarn"].to_numpy() == 0)
    strain = history["cell_strain"].to_numpy()
    course = place[:, own[-1]] - place[:, own[0]]
    if WIDTH in history.attrs:
        stretched = np.stack([1 + strain[:, 0], 0.5 * strain[:, 2], np.zeros(len(place))], axis=1)
        course = history.attrs[WIDTH] * stretched
    start = history.attrs.get("cell_height", fabric.periods[1, 1])
    wale = start * np.stack([0.5 * strain[:, 2], 1 + strain[:, 1], np.zeros(len(place))], axis=1)
    return course, wale


def _repeated(cell: Deformed, vector: np.ndarray, copies: int) -> Deformed:
    """Return a cell and its copies along a vector (T, 3) [m]."""
    count = cell.points.shape[1]
    return Deformed(
        np.concatenate([cell.points + number * vector[:, None] for number in range(copies)], axis=1),
        np.concatenate([cell.faces + number * count for number in range(copies)]),
        np.tile(cell.values, (1, copies)),
        cell.label,
        cell.history,
    )


def _surface_of(solids: Mesh, history: xr.Dataset, colour: str) -> Deformed:
    """Return the surface of solids at full load with a field of their nodes."""
    with naming_extra():
        import pyvista

    name, label, scale = FIELDS[colour]
    if colour == "pressure" and "contact_pressure" not in history:
        raise ConfigurationError("colour is 'pressure' but no yarns of the history are in contact")
    grid: Any = pyvista.from_meshio(solids)
    if name in grid.cell_data:
        grid = grid.cell_data_to_point_data()
    surface = grid.extract_surface(nonlinear_subdivision=1, algorithm="dataset_surface").triangulate()
    if name not in surface.point_data:
        surface[name] = _nearest_pressure(np.asarray(surface.points), history)
    triangles = surface.faces.reshape(-1, 4)[:, 1:]
    points = np.asarray(surface.points, dtype=float) + np.asarray(surface[SHIFTED])
    return Deformed(
        points[None],
        np.column_stack([triangles, triangles[:, 2]]),
        scale * np.asarray(surface[name])[None],
        label,
        history,
    )


def _nearest_pressure(points: np.ndarray, history: xr.Dataset) -> np.ndarray:
    """Return the mean contact pressure (P,) [Pa] of the points in contact that are nearest to each point (P, 3)."""
    last = history["contact_increment"].to_numpy() == history.sizes["increment"] - 1
    place, pressure = (history[f"contact_{name}"].to_numpy()[last] for name in ("reference", "pressure"))
    _, nearest = cKDTree(points).query(place)
    total, number = (
        np.bincount(nearest, weights, len(points)) for weights in (pressure, np.ones_like(pressure))
    )
    return total / np.maximum(number, 1)


@styled
def draw(knit: Deformed, increment: int = -1, view: View = VIEW) -> Figure:
    """Return a figure of one increment with its bar of colours."""
    ends = [Surface(knit.points[end], knit.faces, "") for end in (0, -1)]
    wide = float(np.ptp(view.project(np.concatenate([end.points for end in ends]))[:, 0]))
    picture = Picture(_surfaces(knit, increment), view, bounds(ends, view, below=BELOW * MILLIMETRE * wide))
    drawing, (axes,) = draw_rows([[picture]], SINGLE, head=6.0, foot=BAR)
    axes.set_title(f"{knit.strain[increment]:.1%} strain")
    if knit.cell is not None:
        axes.plot(*(MILLIMETRE * view.project(_outline(knit))).T, "--", color=YARNS[0], linewidth=1.2)
    scale_bar(axes, _round_length(0.25 * float(np.ptp(axes.get_xlim()))), view)
    colour_bar(drawing, knit.scale, knit.label, 0.15, 0.7)
    return drawing


def _outline(knit: Deformed) -> np.ndarray:
    """Return the corners (5, 3) [m] of the undeformed cell in the middle of its copies."""
    middle = 0.5 * (knit.points[-1].min(axis=0) + knit.points[-1].max(axis=0))
    return middle + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) @ (0.5 * np.array(knit.cell))


def _round_length(most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is no longer."""
    power = 10.0 ** np.floor(np.log10(most))
    return float(power * max(digit for digit in (1, 2, 5) if digit * power <= most))


def _surfaces(knit: Deformed, increment: int) -> list[Surface]:
    """Return the facets of an increment; facets without contact pressure are translucent, as they hide the contacts."""
    points, values = knit.points[increment], knit.values[increment]
    colours = knit.scale.to_rgba(values, bytes=True)[:, :3]
    if knit.label != FIELDS["pressure"][1] or not values.any():
        return [Surface(points, knit.faces, "", colours=colours)]
    pressed = values[knit.faces].max(axis=1) > PRESSED * values.max()
    faint = Surface(points, knit.faces[~pressed], YARNS[0], opacity=0.15)
    return [faint, Surface(points, knit.faces[pressed], "", colours=colours)]


def write_picture(knit: Deformed, path: Path, title: str) -> None:
    """Write a picture at full load."""
    save(draw(knit), [path], {"history": knit.history}, title)


def animate(knit: Deformed, path: Path, title: str, progress: ReportProgress = silent) -> None:
    """Write the increments, `FRAMES` of them at most, as an animated WebP, which has no title.

    Raises DataFileError when there is one increment alone, and RenderingError when VTK cannot render on this machine.
    """
    from PIL import Image

    if len(knit.strain) < 2:
        raise DataFileError(
            f"{path}: {knit.label} is of full load only; an animation takes the colours u_z, slip or force"
        )
    frames = []
    for increment in (shown := _spread(len(knit.strain), FRAMES)):
        drawing = draw(knit, increment)
        drawing.set_dpi(resolution())
        frames.append(Image.fromarray(pixels(drawing)[..., :3]))
        progress(len(frames) / len(shown), "")
    pauses = [PAUSE] * (len(frames) - 1) + [5 * PAUSE]
    with replacing(path) as temporary:
        frames[0].save(
            temporary, "WEBP", save_all=True, append_images=frames[1:], duration=pauses, loop=0, quality=80
        )


def _spread(count: int, most: int) -> np.ndarray:
    """Return some of the numbers below a count, evenly, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


MOST = 250_000  # Corners of all increments that a page holds: about 2 MB


def write_page(knit: Deformed, path: Path, title: str) -> None:
    """Write a page of one file that turns the knit in a browser, with a slider over the increments.

    Raises DataFileError when a single increment has too many corners.
    """
    if (count := knit.values.shape[1]) > MOST:
        raise DataFileError(f"{path}: the knit has {count} corners, a page holds {MOST}; show a smaller knit")
    write_text(page_of(knit, title, MOST), path)


def page_of(knit: Deformed, title: str, most: int) -> str:
    """Return the page with as many increments as fit into the largest number of corners, at least one."""
    steps, count = knit.values.shape
    kept = _spread(steps, most // count) if most >= 2 * count else np.array([steps - 1])
    places = MILLIMETRE * knit.points[kept]
    values = knit.values[kept]
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    reach = float((high - low).max())
    scaled = np.round((places - low) / reach * 65535).astype("<u2")
    norm = knit.scale.norm
    shade = np.round(255 * np.clip(norm(values), 0, 1)).astype("u1")
    quads = knit.faces
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    distinct = (np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)
    data = {
        "title": title,
        "label": knit.label,
        "low": norm.vmin,
        "high": norm.vmax,
        "strain": knit.strain[kept].tolist(),
        "count": count,
        "middle": ((high - low) / 2 / reach).tolist(),
        "colours": (COLOURS(np.linspace(0, 1, 256))[:, :3] * 255).astype(int).ravel().tolist(),
        "places": _packed(scaled),
        "values": _packed(shade),
        "triangles": _packed(triangles[distinct].astype("<u4")),
    }
    template = files("knitstudy.use").joinpath("viewer.html").read_text(encoding="utf-8")
    return template.replace("{{ data }}", json.dumps(data).replace("</", "<\\/"))


def _packed(array: np.ndarray) -> str:
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 9)).decode()


def write_surface(knit: Deformed, path: Path | str, title: str = "") -> None:
    """Write the surface of a knit at full load for CAD, as triangles in mm (.stl); there is no room for a title."""
    with naming_extra():
        import meshio

    corners = np.concatenate([knit.faces[:, [0, 1, 2]], knit.faces[:, [0, 2, 3]]])
    points = MILLIMETRE * knit.points[-1]
    one, two = (points[corners[:, i]] - points[corners[:, 0]] for i in (1, 2))
    wide = np.linalg.norm(np.cross(one, two), axis=1) > 0  # caps have corners that coincide
    with replacing(path) as temporary:
        meshio.Mesh(points, [("triangle", corners[wide])]).write(temporary, "stl", binary=True)


# Functions that write a knit into a file with a title, by the suffix of the file
WRITERS = {
    ".png": write_picture,
    ".pdf": write_picture,
    ".webp": animate,
    ".html": write_page,
    ".stl": write_surface,
}
