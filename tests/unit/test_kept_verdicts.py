"""Kept verdicts say when they were made by other code, and are of results that are up to date."""

import pandas as pd
import pytest

from knitstudy.files import read_table, write_table
from knitstudy.measures.claims.verdicts import RULES
from knitstudy.stages.kept_tables import VERDICTS
from knitstudy.stages.plan import Plan


@pytest.fixture
def kept(tmp_path):
    path = tmp_path / "verdicts.csv"
    write_table(pd.DataFrame({"id": ["G1", "K1"], "digest": "beef", "made": "2026-11-20"}), path)
    return path


def test_verdicts_of_other_code_are_said(kept):
    said = VERDICTS.warning(kept, "cafe")
    assert "kept on 2026-11-20" in said
    assert "`make verdicts`" in said


def test_configuration_without_a_full_study_has_other_verdicts(config, kept):
    assert "`make verdicts`" in VERDICTS.warning(kept, VERDICTS.digest_wanted(Plan.of(config), config))


def test_every_claim_has_a_kept_verdict():
    table = read_table(VERDICTS.path, needs=("verdict", "uncertainty", "rule", "see", "digest"))
    assert set(table["id"]) == set(RULES)
