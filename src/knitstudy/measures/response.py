"""Scalars of a history: stiffness, out-of-plane motion, contraction, forces at crossings, energies, penetration.

`QUANTITIES` are those for which reference values exist. Histories are Datasets in the format of files.md;
"at full load" means at the last increment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.measures.centre_cell import centre_cell

X, Y, Z = 0, 1, 2
MEGABYTE = 1e6
NO_GROWTH = 1e3  # Least growth of memory in ratios and logarithms [bytes]
STRAINS = (0.01, 0.02, 0.05)  # Strains of the reference values
SAME_STRAIN = 1e-3  # Relative difference up to which an increment is at a strain


def secant_stiffness(history: xr.Dataset) -> float:
    """Return force over displacement of the driven side at full load [N/m]."""
    return float(history["force"][-1] / history["displacement"][-1])


def at_strain(history: xr.Dataset, strain: float, values: np.ndarray) -> float:
    """Return values (I,) of the increments, interpolated at a strain."""
    return float(np.interp(strain, history["strain"], values))


def increment_at(history: xr.Dataset, strain: float) -> int | None:
    """Return the increment that ends at a strain, if there is one."""
    off = np.abs(history["strain"].to_numpy() - strain)
    nearest = int(off.argmin())
    return nearest if off[nearest] <= SAME_STRAIN * strain else None


def common_strain(histories: Iterable[xr.Dataset]) -> float:
    """Return the largest strain that all histories reach."""
    return min(float(history["strain"][-1]) for history in histories)


def stiffness_at(history: xr.Dataset, strain: float) -> float:
    """Return force over displacement of the driven side at a strain [N/m]."""
    force, displacement = (
        at_strain(history, strain, history[name].to_numpy()) for name in ("force", "displacement")
    )
    return force / displacement


def distance_of_curves(knots: np.ndarray, values: np.ndarray, measure: np.ndarray) -> float:
    """Return the L2 distance of two polygons (n,) with the same knots, over the norm of the second."""

    def square(polygon: np.ndarray) -> float:
        """Integrate the square of a polygon, exactly."""
        a = polygon[:-1]
        b = polygon[1:]
        return float(np.sum(np.diff(knots) * (a * a + a * b + b * b) / 3))

    return float(np.sqrt(square(values - measure) / square(measure)))


def deformed_centrelines(history: xr.Dataset, increment: int = -1) -> np.ndarray:
    """Return the stations (S, 3) of the centrelines at an increment [m]."""
    return history["centreline"].to_numpy() + history["centreline_displacement"].to_numpy()[increment]


def motion(history: xr.Dataset) -> np.ndarray:
    """Return the displacement (I, S, 3) of centrelines since the load path began [m].

    Histories hold displacements from the loops as drawn. A load path that begins at rest begins with other loops.
    """
    drawn = history["centreline_displacement"].to_numpy()
    return drawn - drawn[:1]


def out_of_plane(history: xr.Dataset) -> np.ndarray:
    """Return max |u_z| along the centrelines at every increment (I,) [m]."""
    return np.abs(motion(history)[:, :, Z]).max(axis=1)


def largest_out_of_plane(history: xr.Dataset) -> float:
    """Return max |u_z| along the centrelines at full load [m]."""
    return float(out_of_plane(history)[-1])


def rms_out_of_plane(history: xr.Dataset) -> np.ndarray:
    """Return the root mean square of u_z over the arc length of all centrelines at every increment (I,) [m]."""
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    step = np.where(np.diff(yarn) == 0, np.diff(s), 0.0)
    share = 0.5 * (np.append(step, 0.0) + np.insert(step, 0, 0.0))  # arc length around each station
    u_z = motion(history)[:, :, Z]
    return np.sqrt(u_z**2 @ share / share.sum())


def out_of_plane_correlation(history: xr.Dataset, other: xr.Dataset) -> float:
    """Return the correlation (Pearson) of u_z of two models at full load, at the stations of the first.

    nan where a model stays in its plane.
    """
    ours, theirs = _u_z_at_stations(history, history), _u_z_at_stations(other, history)
    moving = ours.std() > 0 and theirs.std() > 0
    return float(np.corrcoef(ours, theirs)[0, 1]) if moving else np.nan


def _u_z_at_stations(history: xr.Dataset, places: xr.Dataset) -> np.ndarray:
    """Return u_z of a history at full load at the yarns and relative arc lengths of the stations of another."""
    u_z = motion(history)[-1, :, Z]
    yarn = history["yarn"].to_numpy()
    share = _relative_arc_length(history)
    wanted_yarn = places["yarn"].to_numpy()
    wanted = _relative_arc_length(places)
    result = np.empty(len(wanted))
    for number in np.unique(wanted_yarn):
        of, at = yarn == number, wanted_yarn == number
        result[at] = np.interp(wanted[at], share[of], u_z[of])
    return result


def _relative_arc_length(history: xr.Dataset) -> np.ndarray:
    """Return the arc lengths of the stations over the lengths of their yarns."""
    s, yarn = history["arc_length"].to_numpy(), history["yarn"].to_numpy()
    return s / pd.Series(s).groupby(yarn).transform("max").to_numpy()


def transverse_contraction(history: xr.Dataset) -> float:
    """Return by how much of its height the middle of a knit has shrunk at full load [1].

    The height is the extent in y of the centrelines that began in the middle third of the width.
    """
    place = deformed_centrelines(history, 0)
    now = deformed_centrelines(history)
    x = place[:, X]
    middle = np.abs(x - 0.5 * (x.min() + x.max())) <= np.ptp(x) / 6
    return float(1 - np.ptp(now[middle, Y]) / np.ptp(place[middle, Y]))


FORCE, LARGEST_U_Z, RMS_U_Z = "force", "largest |u_z|", "root mean square of u_z"
NORMAL, LARGEST_NORMAL, TANGENTIAL, SLIP = (
    "mean normal force of a crossing",
    "largest normal force of a crossing",
    "mean tangential force of a crossing",
    "mean slip of a crossing",
)

Values = Callable[[xr.Dataset, xr.Dataset], np.ndarray]


def _at_crossings(name: str, statistic: Callable[..., np.ndarray]) -> Values:
    """Return a function of history and contacts: a statistic (I,) of a resultant over the centre cell."""

    def values(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
        resultants = contacts[name].to_numpy()[:, centre_cell(contacts)]
        return statistic(np.linalg.norm(resultants, axis=-1), axis=1)

    return values


def _slip(history: xr.Dataset, contacts: xr.Dataset) -> np.ndarray:
    return np.nan_to_num(contacts["slip"].to_numpy()[:, centre_cell(contacts)]).mean(axis=1)


# Unit, and the values (I,) from a history and its contacts, by name. Crossings are the four of the centre
# cell.
QUANTITIES: dict[str, tuple[str, Values]] = {
    FORCE: ("N", lambda history, contacts: history["force"].to_numpy()),
    LARGEST_U_Z: ("m", lambda history, contacts: out_of_plane(history)),
    RMS_U_Z: ("m", lambda history, contacts: rms_out_of_plane(history)),
    NORMAL: ("N", _at_crossings("normal_resultant", np.mean)),
    LARGEST_NORMAL: ("N", _at_crossings("normal_resultant", np.max)),
    TANGENTIAL: ("N", _at_crossings("tangential_resultant", np.mean)),
    SLIP: ("m", _slip),
}


# ---- Energy balance, artificial energies and penetration of a history that has ended

OF_FINAL = 0.01  # Energies are compared where the internal energy is this share of its final value or more


def energy_gaps(history: xr.Dataset) -> np.ndarray:
    """Return the difference of external work and all stored energies, over the largest external work (I,)."""
    energy = history["energy"]
    external = energy.sel(form="external")
    return (np.abs(2 * external - energy.sum("form")) / np.abs(external).max()).to_numpy()


def energy_gap(history: xr.Dataset) -> float:
    """Return the largest gap of the energy balance (`energy_gaps`)."""
    return float(energy_gaps(history).max())


def hourglass_share(history: xr.Dataset, form: str = "hourglass") -> float:
    """Return the largest hourglass or other over internal energy where the latter is 1% of its final value or more."""
    internal, other = (history["energy"].sel(form=kind) for kind in ("internal", form))
    return float((other / internal.where(internal >= OF_FINAL * internal[-1])).max())


def penetration(history: xr.Dataset) -> float:
    """Return the deepest penetration, 0 where yarns never touch [m]."""
    return -float(np.fmin.reduce(history["smallest_gap"].to_numpy(), initial=0.0))  # nan: no yarns are near


def allowed_penetration(history: xr.Dataset) -> float:
    """Return the penetration limit of contact: of the penalty method, or of the law of local indentation [m]."""
    return float(history.attrs["penetration_limit"])


def memory_growth(history: xr.Dataset) -> float:
    """Return the growth of memory above that of the bare process, at least `NO_GROWTH` [bytes]."""
    return max(float(history.attrs["memory_growth"]), NO_GROWTH)
