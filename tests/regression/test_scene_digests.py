"""Keys that decide a result decide the same result: digests of all scenes, without the code behind them.

A change of them makes every result again. Where that is wanted, ``python tests/regression/test_scene_digests.py`` keeps
the new ones, and the change tells why.
"""

from pathlib import Path

import pandas as pd

from knitstudy.run import plan
from knitstudy.run.configuration import load_scenes
from knitstudy.run.stages import STAGES

KEPT = Path(__file__).with_suffix(".csv")


def digests() -> pd.DataFrame:
    """Return the digest of every dataset of every shipped scene."""
    with_code, plan.code_digest = plan.code_digest, lambda *packages: ""
    try:
        scenes, planned = load_scenes(), plan.Plan.of()
        rows = [
            (scene.name, name, planned.step(name, scene).digest)
            for scene in scenes.values()
            for name, stage in STAGES.items()
            if stage.is_dataset and stage.of(scene)
        ]
    finally:
        plan.code_digest = with_code
    return pd.DataFrame(rows, columns=["scene", "stage", "digest"]).sort_values(["scene", "stage"])


def test_digests_of_scenes():
    # Exact: a digest that changes by one bit makes a result again.
    of = ["scene", "stage"]
    kept, now = pd.read_csv(KEPT).set_index(of)["digest"], digests().set_index(of)["digest"]
    assert kept.index.symmetric_difference(now.index).tolist() == []
    assert now.index[now != kept.reindex(now.index)].tolist() == []


if __name__ == "__main__":
    digests().to_csv(KEPT, index=False)
