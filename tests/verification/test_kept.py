"""Committed tables agree with the present code: their cheapest rows, made again, are the same.

A table is stale as soon as the recorded numbers of its scenes move (`knitstudy.run.committed_tables`); that they say it
is what rows show that are made again. Tables of studies take hours (`make committed-tables`); each check here takes
seconds, predictions of fabrics two minutes.
"""

from pathlib import Path

import extremes
import loops
import mechanisms
import pandas as pd
import pytest
import swatches
from keep import TARGETS

from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.measures.response import FORCE, at_strain
from knitstudy.paper.tables.fabrics import FORCES, Pulled, strip_of
from knitstudy.run.advice import TRADE_KEPT
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.advice.sample import Inputs, load_trade
from knitstudy.run.committed_tables import RUN, runs_of, stale_runs
from knitstudy.run.configuration import CONFIG, load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate
from knitstudy.run.trade import run

SAME = 1e-6
"""Relative: solves end at corrections of 1e-8 of a yarn's radius; two orders are left for the force that follows."""

ROUNDED = 1e-4
"""Relative: strains of predictions are kept with four decimals."""


def reference():
    """Forces of the smallest solid yarn of the reference."""
    table = pd.read_csv(RESOURCES / "reference" / "reference_values.csv")
    of = (table["scene"] == "reference-1x1-tie-course-p3") & (table["quantity"] == FORCE)
    history = simulate(load_scene("reference-1x1-tie-course-p3")).history
    for row in table[of].to_dict("records"):
        yield row["value"], at_strain(history, row["strain [1]"], history["force"])


def verdicts():
    """Force of the smallest simulation behind the sweeps, which the verdicts judge."""
    row = pd.read_csv(RESOURCES / "full" / "sweeps.csv").iloc[0]
    history = simulate(load_scene(row["scene"])).history
    yield row["force [N]"], at_strain(history, row["strain [1]"], history["force"])


def loop_map():
    """Lengths of three loops that fit."""
    table, scene = pd.read_csv(RESOURCES / "loops.csv"), load_scene(loops.SCENE)
    fit = table[table["outcome"] == loops.OUTCOMES[0]]
    for row in fit.iloc[:: len(fit) // 3].to_dict("records"):
        length = list(loops.VARIABLES).index("length")
        yield row["length"], loops._entry(scene, row["course"], row["wale"])[length]


def extreme():
    """Forces of networks, beams and tied solid yarns as they are."""
    table, plan = pd.read_csv(RESOURCES / "extremes.csv").set_index("trial"), Plan.of(CONFIG)
    for trial in extremes.load_trials(CONFIG):
        if trial.group == "as it is" and trial.model in ("rom2d", "rom3d", "beam", "yarns-tie"):
            history = simulate(trial.scene(), plan=plan).history
            yield table.loc[trial.name, "force [N]"], float(abs(history["force"]).max())


def stockinette_swatch():
    """Width of the swatch of one loop."""
    table = pd.read_csv(swatches.KEPT).set_index("swatch")
    more = swatches.more_yarn(swatches.read_measured().dropna())
    rest = swatches.rest_of(swatches.STOCKINETTE, swatches.RULE, more)
    yield table.loc["2_1", "width [mm]"], round(swatches.PATTERN * 1e3 * rest["width"], 1)


def trade():
    """Force of coarse yarns in the first tied cell of the sample."""
    table, trade = pd.read_csv(TRADE_KEPT), load_trade()
    of = (
        (table["case"] == "cell-tied")
        & (table["model setting"] == "yarns-coarse")
        & (table["question"] == "force")
    )
    row = table[of].iloc[0]
    case = next(each for each in trade.cases() if str(each) == row["case"])
    problem = PhysicalProblem(trade.scene(case, Inputs.of_row(row), row["knit"]), trade)
    record = run(problem, "yarns-coarse", Path("run"))
    yield row["value [SI]"], record["values"][row["quantity"]]


def networks():
    """Motion of the drawn knit as a network of beams with rigid ties, as stiff as its yarns are."""
    table = pd.read_csv(RESOURCES / TARGETS["mechanisms"][0])
    kind = {"sweep": "bending and torsion", "value": 1.8, "interaction": "tie", "joint": "rigid"}
    row = table[(table[list(kind)] == pd.Series(kind)).all(axis=1)].iloc[0]
    made = mechanisms.Networks()
    again = made.pull(made.base, kind["interaction"], kind["joint"], mechanisms.Stiffness())
    for quantity, value in again.items():
        yield row[quantity], value


CHECKS = {
    "loops": loop_map,
    "mechanisms": networks,
    "swatches": stockinette_swatch,
    "trade": trade,
    "extremes": extreme,
    "reference": reference,
    "verdicts": verdicts,
}


STALE = {
    "swatches": "widths of beams at rest: yarns are smooth where they touch, and a rest is stable",
    "extremes": "forces of beams in contact move by 1e-3: yarns are smooth where they touch",
}
"""Committed tables of which these rows differ with the present code, and why; a release makes them again."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=STALE[name]))
        if name in STALE
        else name
        for name in CHECKS
    ],
)
def test_the_cheapest_rows_are_made_again(name):
    pairs = list(CHECKS[name]())
    assert pairs, f"resources/{TARGETS[name][0]}: none of its rows was made again"
    for kept, again in pairs:
        assert again == pytest.approx(kept, rel=SAME), f"older than the physics: run `make {name}` and commit"


@pytest.mark.full  # two minutes
def test_predictions_are_made_again():
    """Strains of one strip of garter, from its three cells of soft yarns."""
    of = {"yarn": "cotton", "stitch": "garter", "direction": "course"}
    table = pd.read_csv(RESOURCES / "predictions.csv")
    kept = table[(table[list(of)] == pd.Series(of)).all(axis=1)]
    name = "-".join(("fabric", *of.values()))
    cells = {
        each: Pulled.of(simulate(load_scene(f"{name}-{each}")).history, "course") for each in ("free", "held")
    }
    sheared = simulate(load_scene("fabric-cotton-garter-shear-free")).history
    strip = strip_of(cells, sheared, **of)
    assert list(kept["force_per_width_N_mm"]) == list(FORCES)
    assert strip.strain == pytest.approx(kept["strain"].to_numpy(), abs=ROUNDED)


COMMITTED = sorted({*RESOURCES.rglob("*.csv")} - {RESOURCES / "runs.csv"})
COMMITTED = [path for path in COMMITTED if RUN in pd.read_csv(path, nrows=0)]
"""Committed tables that commands make; others hold what was measured or read elsewhere."""


def test_all_tables_of_targets_are_known():
    assert {RESOURCES / file for file, _ in TARGETS.values()} <= set(COMMITTED)


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.stem)
def test_every_committed_table_says_what_made_it(path):
    """Every run has a row, and every row a run."""
    runs = runs_of(path)
    assert set(pd.read_csv(path)[RUN]) == set(runs.index)
    assert runs[["code", "commit", "made", "command"]].notna().all(axis=None)


STALE_TABLES = {
    "extremes": "beams in contact, and networks whose springs come from contacts",
    "predictions": "beams at rest and in contact",
    "promises": "as trade",
    "shells": "beams at rest and in contact",
    "swatches": "beams at rest",
    "trade": "beams in contact, cells of solid yarns that touch before 30 November",
    "unknowns": "beams at rest and in contact",
}
"""Committed tables with stale runs: models whose numbers have moved since. A release makes them again."""


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.stem)
def test_stale_tables_are_known(path):
    """None is listed in vain."""
    name = path.relative_to(RESOURCES).with_suffix("").as_posix()
    assert bool(stale_runs(path)) == (name in STALE_TABLES), f"{path}: runs {stale_runs(path)} are stale"


def test_networks_change_one_thing_at_a_time():
    """A lever stays within 0.2 % where the spacing changes by 5 % or more, and the spacing where levers change."""
    table = pd.read_csv(RESOURCES / TARGETS["mechanisms"][0]).groupby("sweep")
    levers = ["course spacing [m]", "inner lever [m]", "outer lever [m]"]
    spread = table[levers].max() / table[levers].min() - 1
    fixed = {"levers, spacing fixed": levers[0], "spacing, inner lever fixed": levers[1]}
    fixed |= {"spacing, outer lever fixed": levers[2]} | {
        f"{name} alone": levers for name in ("torsion", "bending")
    }
    for sweep, columns in fixed.items():
        assert (spread.loc[sweep, columns] < 2e-3).all(), sweep
        changed = spread.loc[sweep].drop(columns)
        assert (changed > 0.05).all(), sweep
