"""What is said of a result are its own numbers, with their units."""

import numpy as np
import pytest
from synthetic import contact_history, history

from knitstudy.contacts import contacts
from knitstudy.errors import DataFileError
from knitstudy.loading.history import FORMS
from knitstudy.measures.summary import summarise


def loaded_history(**attributes):
    result = history(lift=1e-4, **attributes)
    energy = np.outer(result["strain"], np.arange(1.0, 1 + len(FORMS)))
    return result.assign(energy=(("increment", "form"), energy), form=list(FORMS))


def said(dataset):
    return {quantity.name: (quantity.value, quantity.unit) for quantity in summarise(dataset)}


def test_history():
    found = said(loaded_history(scene="rom3d-a", digest="0123", fidelity="rom3d", incomplete="no way"))
    assert found["kind"] == ("history", "")
    assert found["scene"] == ("rom3d-a", "")
    assert found["incomplete"] == ("no way", "")
    assert found["dof"] == (600, "1")
    assert found["increments"] == (2, "1")
    assert found["force along the load at the end"] == (10.0, "N")
    assert found["secant stiffness"] == (pytest.approx(10.0 / 0.5e-3), "N/m")
    assert found["largest out-of-plane displacement of centrelines"] == (pytest.approx(2e-4), "m")
    assert found["internal energy at the end"] == (pytest.approx(0.1), "J")
    assert found["wall seconds"] == (1.5, "s")


def test_contacts(knit):
    dataset = contacts.extract(knit, contact_history(knit))
    found = said(dataset)
    assert found["kind"] == ("contacts", "")
    assert found["crossings"] == (36, "1")
    assert found["crossings that are tied"] == (24, "1")
    largest = np.linalg.norm(dataset["force"].isel(increment=-1), axis=-1).max()
    assert found["largest force of a crossing at the end"] == (pytest.approx(largest), "N")


WRONG = {
    "no increments": (lambda d: d.isel(increment=slice(0, 0)), "history: there is no increment in it"),
    "no iterations": (lambda d: d.drop_vars("newton_iterations"), "there is no variable 'newton_iterations'"),
    "other dimensions": (
        lambda d: d.rename(increment="step"),
        r"variable 'force' has the dimensions \(step\) but must have \(increment\)",
    ),
    "one state": (lambda d: d.isel(increment=0), r"variable 'force' has the dimensions \(\) but must have"),
    "texts": (
        lambda d: d.assign(force=d["force"].astype(str)),
        "variable 'force' holds .* but must hold numbers",
    ),
    "no stations": (lambda d: d.isel(station=slice(0, 0)), "there is no station in it"),
    "unnamed forms": (lambda d: d.drop_vars("form"), "energy must have the forms external, internal"),
}


@pytest.mark.parametrize("case", WRONG)
def test_histories_that_are_laid_out_otherwise_are_refused(case):
    change, said = WRONG[case]
    with pytest.raises(DataFileError, match=said):
        summarise(change(loaded_history()))


def test_a_word_where_nothing_touched():
    """A gap of nan and forces of rounding say nothing by themselves."""
    history = loaded_history()
    assert "contact" not in said(history), "yarns that are all tied"
    far = history.assign(smallest_gap=("increment", np.full(history.sizes["increment"], np.nan)))
    energy = history["energy"].where(history["form"] != "penalty", 0.0)
    assert said(far.assign(energy=energy))["smallest gap"] == ("nothing came near anything", "")
    assert said(far.assign(energy=energy))["contact"][0].startswith("nothing touched")
    near = history.assign(smallest_gap=("increment", [3e-6, 2e-6, np.nan]))
    assert said(near)["smallest gap"] == (2e-6, "m")
    assert "contact" not in said(near), "penalty energy says that something touched"
