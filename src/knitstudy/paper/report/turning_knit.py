"""The knit that turns in the report: one deformed knit of the study, as a page within the page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from knitstudy.files import read_dataset
from knitstudy.run.stages import STAGES
from knitstudy.run.store import scenes_of
from knitstudy.use.deformed import deformed, page_of

MOST = 120_000  # Corners of all increments: about 1 MB


def turning_knit(wanted: Sequence[str], data: Iterable[Path]) -> str:
    """Return the page of the first of some scenes whose history is among the data files; an empty text where none is.

    Parameters
    ----------
    wanted : sequence of str
        Names of scenes.
    data : iterable of Path
        Results of the study, in the folders of their stages.
    """
    histories = {path.stem: path for path in data if path.parent.name == "simulation"}
    path = next((histories[name] for name in wanted if name in histories), None)
    if path is None:
        return ""
    history = read_dataset(path)
    scene, _ = scenes_of(history, path)
    geometry = read_dataset(path.parents[1] / STAGES["geometry"].path(scene))
    title = f"{scene.kind.fidelity.label}, {scene.kind.interaction.meaning}"
    return page_of(deformed(scene, geometry, history), title, MOST)
