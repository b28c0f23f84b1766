"""A jersey of a known yarn, a nylon monofilament: shape and force with nothing fitted, for frictions from 0 to 0.5.

``python benchmarks/nylon.py`` keeps the prediction in resources/nylon.csv, and prints its intervals;
``python benchmarks/nylon.py --compare`` draws the measured law beside it, docs/notes/nylon.webp, and prints how far it
is (docs/notes/memory.md). Histories that have been computed are in results/nylon: a run that was stopped goes on.

The jersey is that of Poincloux, Adda-Bedia and Lechenault 2018 (doi 10.1103/PhysRevX.8.021075).
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from records import Record, code_of, counted, record

from knitstudy import CellOfBeams, CellStrain, Friction, Pattern, SetYarn, simulate
from knitstudy.datasets import read_table
from knitstudy.errors import ConvergenceError
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.run.behaviour import ENDLESS_BEAMS, behaviour
from knitstudy.run.committed_tables import keep_table

KEPT = RESOURCES / "nylon.csv"
PICTURE = RESOURCES.parent / "docs" / "notes" / "nylon.webp"
HISTORIES = Path("results/nylon")

YARN = SetYarn(diameter=80e-6, youngs_modulus=5.1e9, set=0.0)  # straight without forces: assumed
LOOP_LENGTH = 9.6e-3  # m, of yarn in a stitch
FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
DRAWINGS = {"wide": (2.2e-3, 4.2e-3), "narrow": (2.6e-3, 3.8e-3)}
"""Course and wale spacings of drawn loops [m]; friction holds a shape at rest that depends on them."""

CASES = [
    *[(friction, "wide") for friction in FRICTIONS],
    *[
        (friction, "narrow") for friction in (0.0, 0.3, 0.4, 0.5)
    ],  # 0.1 and 0.2 find no rest within eight minutes
]

TURNS = (0.2, 0.0, 0.2)  # strains of the shape at rest along wales: pulled, let go and pulled again
INCREMENTS = 120
LEGS = ("pulled", "let go", "pulled again")
FORCES_AT = {"pulled": (0.1, 0.2), "let go": (0.1,)}  # strains; where it turns friction has not turned yet
BEAM_SIZE = 2.5  # over the radius: an eightieth of a stitch

# Measured: printed numbers of the jersey, and its law of the force of a stitch, Y ((c*/c)^2 - (w*/w)^2)
REST_C, REST_W = 3.93, 2.08  # mm
DELTA = 0.86  # - dc / dw
POISSON = 0.46
MODULI = {"pulled": 38.0, "let go": 8.0}  # Y, fitted to the measured curves [mN]


def scene_of(friction: float, drawing: str) -> CellOfBeams:
    """Return the scene of one stitch that is pulled along its wales, free across."""
    course, wale = DRAWINGS[drawing]
    scene = CellOfBeams(
        pattern=Pattern(course_spacing=course, wale_spacing=wale, loop_length=LOOP_LENGTH, loops=1, rows=1),
        yarn=YARN,
        load=CellStrain(deformation="wale", strain=TURNS[-1], turns=TURNS[:-1], lateral="free"),
        contact=Friction(friction=friction),
    )
    return scene.vary(
        {
            "load.start": "rest_with_friction",
            "load.largest_force": None,
            "mesh.beam_size": BEAM_SIZE,
            "solver.increments": INCREMENTS,
        }
    )


def legs_of(strain: np.ndarray) -> list[str]:
    """Return for every state which leg of the load path it ends."""
    way = np.cumsum(np.abs(np.diff(strain, prepend=0.0)))
    corners = np.cumsum(np.abs(np.diff(TURNS, prepend=0.0)))
    return [LEGS[min(int(number), len(LEGS) - 1)] for number in np.searchsorted(corners, way - 1e-9)]


def history_of(friction: float, drawing: str) -> Record:
    """Return spacings [mm] and the force of a stitch [mN] along the load path, or the fault that ended it."""
    begun = time.process_time()
    try:
        history = simulate(scene_of(friction, drawing)).history
    except ConvergenceError as error:
        return {"fault": str(error), "seconds": time.process_time() - begun}
    strain = history["cell_strain"].to_numpy()[:, :2]
    c, w = 1e3 * (np.array([history.attrs["cell_width"], history.attrs["cell_height"]]) * (1 + strain)).T
    force = 1e3 * history["force_per_width"].to_numpy()[:, 1] * history.attrs["cell_width"]
    return {
        "leg": legs_of(strain[:, 1]),
        "strain": strain[:, 1].tolist(),
        "c [mm]": c.tolist(),
        "w [mm]": w.tolist(),
        "force [mN]": force.tolist(),
        "seconds": time.process_time() - begun,
        "fault": "",
    }


def predict() -> pd.DataFrame:
    """Return the states of all histories: friction, drawing, leg, strain, spacings [mm], force of a stitch [mN]."""
    of_all = [behaviour([ENDLESS_BEAMS]), code_of(__file__)]
    parts = []
    for friction, drawing in counted(CASES, "histories"):
        name = f"{friction:g}-{drawing}"
        depends_on = [*of_all, scene_of(friction, drawing).hash]
        found = record(HISTORIES, name, depends_on, partial(history_of, friction, drawing))
        print(f"friction {friction:g}, {drawing}: {found['seconds']:.0f} s {found['fault']}", flush=True)
        if not found["fault"]:
            states = pd.DataFrame({key: found[key] for key in found if key not in ("seconds", "fault")})
            parts.append(states.assign(friction=friction, drawing=drawing)[["friction", "drawing", *states]])
    return pd.concat(parts, ignore_index=True)


def force_at(states: pd.DataFrame, strain: float) -> float:
    """Return the force [mN] of the states of one leg at a strain."""
    ordered = states.sort_values("strain")
    return float(np.interp(strain, ordered["strain"], ordered["force [mN]"]))


def numbers_of(history: pd.DataFrame) -> pd.Series:
    """Return the numbers that are compared of one history."""
    c, w = (history[name].to_numpy() for name in ("c [mm]", "w [mm]"))
    legs = {name: states for name, states in history.groupby("leg")}
    pulled = legs["pulled"]
    delta = -np.polyfit(pulled["w [mm]"], pulled["c [mm]"], 1)[0]
    work = {name: np.trapezoid(states["force [mN]"], states["w [mm]"]) for name, states in legs.items()}
    values = {"c at rest [mm]": c[0], "w at rest [mm]": w[0], "delta": delta, "nu": delta * w[0] / c[0]}
    for name in ("pulled", "let go"):
        for strain in FORCES_AT[name]:
            values[f"{name}, force at {strain:.0%} [mN]"] = force_at(legs[name], strain)
    values["share of the work that comes back"] = -work["let go"] / work["pulled"]
    return pd.Series(values)


def law(c: np.ndarray, w: np.ndarray, modulus: float) -> np.ndarray:
    """Return the measured force of a stitch [mN] at spacings [mm]: Y ((c*/c)^2 - (w*/w)^2)."""
    return modulus * ((REST_C / c) ** 2 - (REST_W / w) ** 2)


def measured() -> pd.Series:
    """Return the same numbers of the measured jersey, by its printed spacings, ratio and law."""
    strain = np.linspace(0.0, TURNS[0], 201)
    w = REST_W * (1 + strain)
    c = REST_C - DELTA * (w - REST_W)
    forces = {name: law(c, w, modulus) for name, modulus in MODULI.items()}
    values = {"c at rest [mm]": REST_C, "w at rest [mm]": REST_W, "delta": DELTA, "nu": POISSON}
    for name, force in forces.items():
        for at in FORCES_AT[name]:
            values[f"{name}, force at {at:.0%} [mN]"] = float(np.interp(at, strain, force))
    values["share of the work that comes back"] = MODULI["let go"] / MODULI["pulled"]
    return pd.Series(values)


def draw(states: pd.DataFrame) -> None:
    """Draw forces of a stitch over course spacings, beside the measured law."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    drawings = list(DRAWINGS)
    figure, panels = plt.subplots(
        1, len(drawings), figsize=(8.4, 3.4), layout="constrained", sharex=True, sharey=True
    )
    colours = dict(zip(FRICTIONS, plt.rcParams["axes.prop_cycle"].by_key()["color"], strict=False))
    for drawing, axes in zip(drawings, panels, strict=True):
        for friction, history in states[states["drawing"] == drawing].groupby("friction"):
            axes.plot(
                history["w [mm]"],
                history["force [mN]"],
                lw=1,
                color=colours[friction],
                label=f"friction {friction:g}",
            )
        w = np.linspace(REST_W, (1 + TURNS[0]) * REST_W, 50)
        for (name, modulus), dash in zip(MODULI.items(), ("-", "--"), strict=True):
            axes.plot(
                w, law(REST_C - DELTA * (w - REST_W), w, modulus), "k" + dash, lw=2, label=f"measured, {name}"
            )
        course, wale = DRAWINGS[drawing]
        axes.set(xlabel="course spacing w [mm]", title=f"drawn {1e3 * wale:g} x {1e3 * course:g} mm")
    panels[0].set_ylabel("force of a stitch along wales [mN]")
    panels[0].legend(fontsize=7)
    figure.savefig(PICTURE, dpi=90)


def main() -> None:
    """Predict, or compare what was predicted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--compare", action="store_true", help="compare the kept prediction with the measured law"
    )
    parser.add_argument(
        "--friction", type=float, nargs="+", default=FRICTIONS, help="coefficients of friction"
    )
    asked = parser.parse_args()
    if asked.compare:
        states = read_table(KEPT)
        draw(states)
    else:
        states = keep_table(predict(), KEPT, "python benchmarks/nylon.py", [ENDLESS_BEAMS], digits=5)
    numbers = states.groupby(["friction", "drawing"], sort=False)[list(states)].apply(numbers_of)
    print(numbers.T.round(3).to_string())
    rubbing = numbers[numbers.index.get_level_values("friction") > 0]
    interval = pd.DataFrame({"lower": rubbing.min(), "upper": rubbing.max()})
    if asked.compare:
        interval = interval.assign(measured=measured())
        interval["inside"] = interval["measured"].between(interval["lower"], interval["upper"])
    print(interval.round(3).to_string())


if __name__ == "__main__":
    main()
