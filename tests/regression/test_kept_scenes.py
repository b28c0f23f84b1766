"""Tables in `resources` hold results of the scenes of today: the hash of a scene is that of all keys that decide it.

Where a key is to change, the tables are made again; where it goes and the problem stays, their hashes are replaced. A
table that counts as stale already (`tests/verification/test_kept.py` lists these) may be of other scenes as well.
"""

import pandas as pd
import pytest

from knitstudy.paper.report import FULL_SCENES, REFERENCE_VALUES
from knitstudy.run.committed_tables import stale_runs
from knitstudy.run.configuration import load_scenes


@pytest.mark.parametrize("table", [FULL_SCENES, REFERENCE_VALUES], ids=lambda table: table.stem)
def test_kept_results_are_of_the_scenes_of_today(table):
    kept = pd.read_csv(table, dtype=str).drop_duplicates(["scene", "keys"]).set_index("scene")["keys"]
    scenes = load_scenes()
    assert len(kept) > 30
    changed = [name for name, hash_ in kept.items() if name not in scenes or scenes[name].hash != hash_]
    assert not changed or stale_runs(table), changed
