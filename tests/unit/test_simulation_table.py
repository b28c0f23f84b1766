from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from knitstudy.loading.history import FORMS
from knitstudy.measures.history_checks import hourglass_share, ledger_gap
from knitstudy.tables import catalogue


@pytest.fixture
def history():
    """Three increments: external work 0, 1, 4 J; internal 0.03, 0.99, 3.9 J; hourglass 0.02, 0.03, 0.06 J."""
    energy = np.zeros((3, len(FORMS)))
    energy[:, FORMS.index("external")] = [0.0, 1.0, 4.0]
    energy[:, FORMS.index("internal")] = [0.03, 0.99, 3.9]
    energy[:, FORMS.index("hourglass")] = [0.02, 0.03, 0.06]
    return xr.Dataset(
        {
            "energy": (("increment", "form"), energy),
            "tied_area": ("crossing", [1e-7, 3e-7]),
            "residual": ("increment", [0.0, 2e-7, 1e-8]),
            "correction": ("increment", [0.0, 1e-9, 3e-7]),
            "newton_iterations": ("increment", [0, 4, 3]),
            "krylov_iterations": ("increment", [0, 40, 30]),
        },
        coords={"form": list(FORMS)},
        attrs={"tie_nodes": 8, "linear_setups": 2},
    )


def test_ledger_and_hourglass_by_hand(history):
    assert ledger_gap(history) == pytest.approx(0.05 / 4)  # |0 - 0.03 - 0.02| is the largest gap
    # The first increment does not count: its 0.03 J are less than 1% of 3.9 J.
    assert hourglass_share(history) == pytest.approx(0.03 / 0.99)


def test_table_of_the_direct_simulation(history):
    scenes = {
        "dns": SimpleNamespace(solver=SimpleNamespace(residual_tolerance=1e-6, correction_tolerance=1e-6))
    }
    table = catalogue.tabulate("simulation", dns=history, scenes=scenes).set_index("quantity")
    assert table.loc["Newton iterations", "value"] == 7
    assert table.loc["Krylov iterations", "value"] == 70
    assert table.loc["largest residual over mean internal force", ["value", "bar"]].tolist() == [2e-7, 1e-6]
    assert table.loc["tied area of a crossing, largest", "value"] == 3e-7
    assert set(table["unit"]) == {"1", "m2"}


def test_table_of_contact_adds_penetration_and_dissipation(history):
    energy = history["energy"].copy(deep=True)
    energy.loc[{"form": "friction"}] = [0.0, 0.05, 0.4]
    energy.loc[{"form": "stabilisation"}] = [0.01, 0.0297, 0.039]
    contact = history.assign(
        energy=energy,
        smallest_gap=("increment", [1e-5, -3e-6, -1e-6]),
        augmentations=("increment", [0, 2, 1]),
    ).assign_attrs(penetration_limit=3e-6)
    scenes = {
        "dns": SimpleNamespace(solver=SimpleNamespace(residual_tolerance=1e-6, correction_tolerance=1e-6))
    }
    table = catalogue.tabulate("simulation_contact", dns=contact, scenes=scenes).set_index("quantity")
    assert table.loc["deepest penetration", ["value", "bar"]].tolist() == [3e-6, 3e-6]
    law = contact.assign_attrs(indentation_deepest=1e-4, penetration_limit=np.inf)
    soft = catalogue.tabulate("simulation_contact", dns=law, scenes=scenes).set_index("quantity")
    assert soft.loc["deepest local indentation", ["value", "bar"]].tolist() == [3e-6, 1e-4]
    assert table.loc["augmentations", "value"] == 3
    assert table.loc["friction over external work at full load", "value"] == pytest.approx(0.1)
    assert table.loc["largest stabilisation over internal energy", "value"] == pytest.approx(0.03)
    assert table.loc["stabilisation over internal energy at full load", "value"] == pytest.approx(0.01)
