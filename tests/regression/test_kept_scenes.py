"""Tables in `resources` hold results of the scenes of today: the hash of a scene is that of all keys that decide it.

Where a key is to change, the tables are made again; where it goes and the problem stays, their hashes are replaced.
"""

import pandas as pd
import pytest

from knitstudy.paper.report import FULL_SCENES, REFERENCE_VALUES
from knitstudy.run.configuration import load_scenes


@pytest.mark.parametrize("table", [FULL_SCENES, REFERENCE_VALUES], ids=lambda table: table.stem)
def test_kept_results_are_of_the_scenes_of_today(table):
    kept = pd.read_csv(table, dtype=str).drop_duplicates(["scene", "keys"]).set_index("scene")["keys"]
    scenes = load_scenes()
    assert len(kept) > 30
    assert [name for name, hash_ in kept.items() if scenes[name].hash != hash_] == []
