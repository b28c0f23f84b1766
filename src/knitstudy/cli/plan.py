"""``knitstudy plan``: which model answers a question surely enough, and what it will cost."""

from __future__ import annotations

from pathlib import Path

import click

from knitstudy.cli.options import config_option, set_option
from knitstudy.cli.output import plain, print_table
from knitstudy.study.choice import digits
from knitstudy.study.configuration import plan_of
from knitstudy.study.planning import Planned, of_model
from knitstudy.study.scene import flattened

ASKS = ("question", "accuracy", "seconds", "memory")


@click.command(short_help="Which model answers a question, and at what price.")
@click.argument("scene")
@click.option("--question", help="force, out_of_plane, contact or stress.")
@click.option("--accuracy", type=float, help="Relative error that may be made, for example 0.05.")
@click.option("--seconds", type=float, help="What it may take at most [s].")
@click.option("--memory", type=float, help="By how much memory may grow at most [MB].")
@set_option
@config_option
def plan(scene: str, changes: tuple, config: Path, **asks: str | float | None) -> None:
    """Print the cheapest model that answers a question about a scene surely enough, with the reason, the expected
    error and the price. Nothing runs.

    Errors and prices are those that were measured (resources/trade.csv, docs/accuracy.md): of the same interaction and
    load, on one cell or on 3 x 3. Prices of larger knits follow the laws by which time and memory were seen to grow.

    A scene asks by itself with these keys; `knitstudy run`, `make study` and everything else then see an ordinary
    scene of the model that was chosen:

    \b
    fidelity: auto
    ask.question: force            # or out_of_plane, contact, stress
    ask.accuracy: 0.05             # relative error that may be made
    ask.seconds: 30                # at most, if it matters
    ask.memory: 500                # MB, likewise

    Of any other scene the options ask, whatever model it names:

    \b
    knitstudy plan yarns-tie-course --question force --accuracy 0.05
    knitstudy plan yarns-isotropic-wale --question contact --accuracy 0.1 --seconds 30
    knitstudy plan dns-tie-course --question force --accuracy 0.05 --set pattern.loops=10 --set pattern.rows=10
    knitstudy run yarns-tie-course --set fidelity=auto --set ask.question=force --set ask.accuracy=0.05

    The second line of the table that is printed costs more and is surer than the first, and so on: what more accuracy
    costs. An accuracy or a budget that nothing keeps ends with one message that says what comes nearest.
    """
    said = {f"ask.{name}": value for name, value in asks.items() if value is not None}
    _print(plan_of(scene, dict(changes) | said, config))


def _print(found: Planned) -> None:
    """Print what was asked, chosen and expected, the front, and the keys that the choice sets."""
    choice, scene, problem = found.choice, found.scene, found.problem
    ask, rung, size = choice.ask, choice.rung, f"{choice.measured} x {choice.measured}"
    grown = f"; price grown from {size} cells" if choice.cells > choice.measured else ""
    click.echo(
        f"{scene.name}: {ask.question} within {100 * ask.accuracy:g} %, {problem.interaction},"
        f" {scene.load.direction} tension, {scene.pattern.loops} x {scene.pattern.rows} cells"
    )
    click.echo(f"take {choice}")
    click.echo(
        f"because nothing cheaper of what was measured on {size} cells is as sure (scene {rung.scene}){grown}"
    )
    print_table(
        ("model", "error at most [%]", "seconds", "MB", ""),
        [
            (
                str(each),
                *map(digits, (100 * each.error, each.seconds, each.memory)),
                "taken" if each == rung else "",
            )
            for each in dict.fromkeys((*choice.front, rung))
        ],
    )
    sets = {"fidelity": scene.fidelity}
    if scene.interaction != problem.interaction:
        sets["interaction"] = scene.interaction
    sets |= {key: value for key, value in flattened(scene).items() if of_model(key) and key != "outputs"}
    click.echo("; ".join(f"{key}: {plain(value)}" for key, value in sets.items()))
