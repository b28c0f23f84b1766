"""What is said of a result are its own numbers, with their units."""

import numpy as np
import pytest
import xarray as xr
from synthetic import contact_history, geometry, history

from knitstudy.crossings import contacts
from knitstudy.errors import DataFileError
from knitstudy.geometry.pair import Pair
from knitstudy.loading.history import FORMS
from knitstudy.mesh.pair import mesh_pair
from knitstudy.summary import kind_of, summarise


@pytest.fixture
def pair():
    return Pair(0.9e-3, 90.0, 5e-3, 0.01)


def loaded_history(**attributes):
    result = history(lift=1e-4, **attributes)
    energy = np.outer(result["strain"], np.arange(1.0, 1 + len(FORMS)))
    return result.assign(energy=(("increment", "form"), energy), form=list(FORMS))


def said(dataset):
    return {quantity.name: (quantity.value, quantity.unit) for quantity in summarise(dataset)}


def test_history():
    found = said(loaded_history(scene="rom3d-a", scene_hash="0123", fidelity="rom3d", incomplete="no way"))
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


def test_unloaded_history_has_no_stiffness():
    found = said(loaded_history(strain=(0.0,), force=(0.0,)))
    assert "secant stiffness" not in found
    assert found["increments"] == (0, "1")


def test_geometry_of_a_knit_is_the_optimised_one(knit):
    found = said(geometry(knit))
    assert found["kind"] == ("geometry", "")
    assert found["loops"] == (3, "1")
    assert found["leg angle"][0] == 80.0
    assert found["yarn diameter"] == (pytest.approx(1.8e-3), "m")
    assert found["crossings"] == (36, "1")


def test_geometry_and_mesh_of_a_pair(pair):
    assert said(pair.to_dataset())["angle"] == (90.0, "degree")
    mesh = mesh_pair(pair, 0.6e-3, 1.2)
    found = said(mesh.to_dataset())
    assert found["kind"] == ("mesh", "")
    assert found["hexahedra"] == (len(mesh.hexahedra), "1")
    assert found["yarns"] == (2, "1")


def test_contacts(knit):
    dataset = contacts.extract(knit, contact_history(knit))
    found = said(dataset)
    assert found["kind"] == ("contacts", "")
    assert found["crossings"] == (36, "1")
    assert found["crossings that are tied"] == (24, "1")
    largest = np.linalg.norm(dataset["force"].isel(increment=-1), axis=-1).max()
    assert found["largest force of a crossing at the end"] == (pytest.approx(largest), "N")


def test_other_files_are_refused():
    with pytest.raises(
        DataFileError, match=r"must have the variables of one of history, contacts, mesh, geometry"
    ):
        kind_of(xr.Dataset({"temperature": 300.0}))
