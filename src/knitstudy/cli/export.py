"""``knitstudy export``: a scene as an input deck of another program."""

from __future__ import annotations

from pathlib import Path

import click

from knitstudy.cli.options import changed_scene, config_option, set_option


@click.command(short_help="A scene as an input deck of Abaqus or CalculiX.")
@click.argument("scene")
@click.option(
    "--dialect", type=click.Choice(["abaqus", "calculix"]), required=True, help="The other program."
)
@set_option
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="The deck's file; SCENE.DIALECT.inp in the current folder by default.",
)
@config_option
def export(scene: str, dialect: str, changes: tuple, output: Path | None, config: Path) -> None:
    """Write a scene of hexahedra as an input deck (.inp): mesh, ties, contact, grips and load, in m, N and Pa.

    \b
    knitstudy export dns-tie-course --dialect calculix
    knitstudy export pair-slid-90 --dialect abaqus --set mesh.size=0.3e-3 -o pair.inp
    """
    # Imported here: --help need not wait for it.
    from knitstudy.exchange.deck import require_deck, specimen_deck
    from knitstudy.exchange.inp import write_inp
    from knitstudy.stages.simulate import lay_out

    wanted = changed_scene(scene, changes, config)
    require_deck(wanted)
    chosen, specimen, mesh = lay_out(wanted, config=config)
    path = output or Path(f"{chosen.name}.{dialect}.inp")
    deck = specimen_deck(chosen, specimen, mesh)
    write_inp(deck, path, dialect)
    click.echo(f"{path}: {len(deck.nodes)} nodes, {len(mesh.hexahedra)} hexahedra; m, N, Pa")
