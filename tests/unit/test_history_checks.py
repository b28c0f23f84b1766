"""Checks of histories by hand, the faults of one that has ended, and the tables of direct simulations."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from history_checks import DEEPEST, faults, is_unloaded, unbalanced_contact
from synthetic import history

from knitstudy.datasets import STRAINS
from knitstudy.knit.loading.history import FORMS
from knitstudy.measures.response import energy_gap, hourglass_share, penetration
from knitstudy.measures.summary import summarise
from knitstudy.run.catalogue import TABLES

WORK = 1e-3  # external work at full load [J]


def energies(**shares):
    """Return the energies of three increments over their work: internal energy but for some shares."""
    share = {form: shares.get(form, 0.0) for form in FORMS}
    share |= {"external": 1.0, "internal": shares.get("internal", 1.0 - sum(shares.values()))}
    return WORK * np.linspace(0, 1, 3)[:, None] ** 2 * np.array([share[form] for form in FORMS])


@pytest.fixture
def whole():
    """Function that returns a sound history but for some changes."""

    def made(load=(0.0, 0.5, 1.0), residual=1e-9, energy=None, **columns):
        dataset = history().assign(
            load=("increment", np.array(load)),
            residual=("increment", np.full(3, residual)),
            reaction=(("increment", "xyz"), np.zeros((3, 3))),
            energy=(("increment", "form"), energies() if energy is None else energy),
            **{name: ("increment", np.array(values)) for name, values in columns.items()},
        )
        return dataset.assign_coords(form=list(FORMS))

    return made


@pytest.mark.parametrize(
    ("made", "message"),
    [
        ({}, []),
        ({"load": (0.0, 0.5, 0.9)}, ["ends at load factor 0.9"]),
        ({"residual": 2e-6}, ["residual 2.00e-06"]),
        ({"energy": energies(internal=0.94)}, ["energy balance misses 6.0%"]),
    ],
)
def test_values_outside_of_their_limits_are_faults(whole, plain_scene, made, message):
    assert faults(whole(**made), plain_scene) == message


@pytest.mark.parametrize("name", ["force", "residual", "load"])
def test_values_that_are_no_numbers_are_faults(whole, plain_scene, name):
    dataset = whole()
    dataset[name][-1] = np.nan
    assert faults(dataset, plain_scene) == [f"{name} holds a value that is not a number"]


def test_penetration_is_compared_with_the_limit_of_contact(whole, plain_scene):
    deep = whole(smallest_gap=(1e-5, -1e-6, -2e-5))
    assert faults(deep.assign_attrs(penetration_limit=3e-5), plain_scene) == []
    (message,) = faults(deep.assign_attrs(penetration_limit=1e-5), plain_scene)
    assert message == "penetration 2.00e-05 m, allowed 1.00e-05 m"
    assert faults(deep, plain_scene) == []  # beams: by their radius alone
    through = whole(smallest_gap=(0.0, 0.0, -1.01 * DEEPEST * plain_scene.yarn.radius))
    assert faults(through, plain_scene)[0].startswith("penetration ")
    apart = whole(smallest_gap=(np.nan, np.nan, np.nan))
    assert (faults(apart, plain_scene), penetration(apart)) == ([], 0)


def test_rounding_errors_of_the_energy_balance_are_no_fault(whole, plain_scene):
    open_one = whole(energy=1e-15 * energies(internal=0.5))
    assert is_unloaded(open_one, plain_scene)
    assert faults(open_one, plain_scene) == []


def test_forces_of_contact_are_in_balance(whole):
    force = np.zeros((3, 2, 3))
    force[-1] = [[0, 0, 1.0], [0, 0, -1.0]]
    dims = ("increment", "yarn_number", "xyz")
    assert unbalanced_contact(whole().assign(yarn_force=(dims, force))) == 0.0
    force[-1, 0, 2] = 1.2
    assert unbalanced_contact(whole().assign(yarn_force=(dims, force))) == pytest.approx(0.2 / 2.2)
    assert unbalanced_contact(whole().assign(yarn_force=(dims, 0 * force))) == 0.0


SCENES = {"dns": SimpleNamespace(solver=SimpleNamespace(residual_tolerance=1e-6, correction_tolerance=1e-6))}


@pytest.fixture
def direct():
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


@pytest.mark.optional_packages
def test_table_of_a_direct_simulation(direct):
    assert energy_gap(direct) == pytest.approx(0.05 / 4)  # |0 - 0.03 - 0.02| is the largest gap
    # The first increment does not count: its 0.03 J are less than 1% of 3.9 J.
    assert hourglass_share(direct) == pytest.approx(0.03 / 0.99)
    table = TABLES.make("simulation", dns=direct, scenes=SCENES).set_index("quantity")
    assert table.loc["Newton iterations", "value"] == 7
    assert table.loc["Krylov iterations", "value"] == 70
    assert table.loc["largest residual over mean internal force", ["value", "bar"]].tolist() == [2e-7, 1e-6]
    assert table.loc["tied area of a crossing, largest", "value"] == 3e-7
    assert set(table["unit"]) == {"1", "m2"}


@pytest.mark.parametrize(("shear", "leans"), [(-0.08, True), (0.005, False)])
def test_a_cell_that_leans_names_its_mirror_image(shear, leans):
    """Pulled straight, an unstable knit shears to one side; the other side is as likely."""
    states = np.array([[0, 0, 0], [0.15, -0.02, shear / 2], [0.3, -0.03, shear]])
    of = ("increment", "plane"), states
    of_forms = ("increment", "form"), energies()
    cell = history().assign(cell_strain=of, force_per_width=of, energy=of_forms)
    cell = cell.assign_coords(plane=list(STRAINS), form=list(FORMS))
    said = {each.name: each.value for each in summarise(cell)}
    assert said["shear strain at the end"] == shear
    assert ("shear" in said) == leans
