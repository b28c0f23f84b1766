"""``knitstudy sheet``: all numbers of a fabric on one page."""

from __future__ import annotations

from math import nan
from pathlib import Path

import click

from knitstudy.run.commands import console
from knitstudy.run.commands.console import SIZE, changed_scene, config_option, scene_argument, set_option


@click.command()
@scene_argument()
@click.option("--tex", type=SIZE, help="Linear density of the yarn [g/km], if the yarn has none.")
@click.option(
    "--density", type=SIZE, help="Density of the yarn with the air in it [kg/m3], instead of its tex."
)
@click.option("--force", type=SIZE, default=100.0, show_default=True, help="Largest force per width [N/m].")
@click.option(
    "--ratio",
    "ratios",
    type=click.FloatRange(-5, 5),
    multiple=True,
    default=(1.0,),
    show_default=True,
    help="Wale strain over course strain of a path that prescribes both; may be repeated.",
)
@click.option(
    "--pressure",
    "pressures",
    type=SIZE,
    multiple=True,
    default=(49.0, 1000.0, 4900.0),
    show_default=True,
    help="Pressure of plates at which the thickness is given [Pa]; may be repeated.",
)
@set_option
@console.output_option
@config_option
def sheet(
    scene: str,
    tex: float | None,
    density: float | None,
    force: float,
    ratios: tuple[float, ...],
    pressures: tuple[float, ...],
    changes: console.Changes,
    output: Path,
    config: Path,
) -> None:
    """Print the numbers of the fabric of SCENE, and write them with curves and decks into OUTPUT/sheet/SCENE.

    The fabric is a cell of beams that slide with friction, whatever model the scene names: its stitches, its shape at
    rest, stretching and one cycle in both directions, both at once, shear, bending and curling, and the thickness
    between plates. Every number has an uncertainty, or is marked "not known" or "given". A jersey takes a minute or
    two, a rib or a half cardigan several. Histories are kept in OUTPUT and reused.

    \b
    knitstudy sheet jersey.yaml --tex 30
    knitstudy sheet fabric-acrylic-stockinette-course-free --force 50
    knitstudy sheet jersey.yaml --ratio 0.5 --ratio 1 --ratio 2
    knitstudy sheet my-rib --density 909 --set contact.friction=0.2
    """
    if tex is not None and density is not None:
        raise click.UsageError("--tex and --density conflict: give only one of them")
    # The models are imported here: the other commands and --help do not need them.
    from knitstudy.knit.loading.run import Progress
    from knitstudy.measures.construction import tex_of
    from knitstudy.run.commands.run import log_on_console
    from knitstudy.use.fabric_sheet import fabric_sheet

    chosen = changed_scene(scene, changes, config)
    if density is not None:
        tex = tex_of(chosen.yarn.diameter, density)
    with log_on_console(verbose=False):
        made = fabric_sheet(
            chosen,
            tex=nan if tex is None else tex,
            force=force,
            ratios=ratios,
            pressures=pressures,
            folder=output,
            config=config,
            progress=Progress,
        )
        page, *files = made.write(output / "sheet" / made.scene.name)
    console.print_table([*made.numbers], made.numbers.to_numpy().tolist())
    for note in made.notes:
        console.say(note, err=True)
    console.say(f"{page}, {', '.join(file.name for file in files)}", err=True)
