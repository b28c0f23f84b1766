"""A history that ended is judged by its numbers: whatever is wrong with it is found."""

import numpy as np
import pytest
from synthetic import history

from knitstudy.loading.history import FORMS
from knitstudy.measures.history_checks import DEEPEST, faults, is_unloaded, unbalanced_contact

WORK = 1e-3
"""External work at full load [J]."""


def energies(**shares):
    """Energies of three increments over their work: all of it internal but for what is said."""
    share = {form: shares.get(form, 0.0) for form in FORMS}
    share |= {"external": 1.0, "internal": shares.get("internal", 1.0 - sum(shares.values()))}
    return WORK * np.linspace(0, 1, 3)[:, None] ** 2 * np.array([share[form] for form in FORMS])


@pytest.fixture
def whole():
    """Function that returns a history in which all is right but what is said."""

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


def test_a_sound_history_has_no_faults(whole, plain_scene):
    assert faults(whole(), plain_scene) == []


@pytest.mark.parametrize("name", ["force", "residual", "load"])
def test_what_is_no_number_is_found(whole, plain_scene, name):
    dataset = whole()
    dataset[name][-1] = np.nan
    assert faults(dataset, plain_scene) == [f"{name} holds what is no number"]


@pytest.mark.parametrize(
    ("made", "said"),
    [
        ({"load": (0.0, 0.5, 0.9)}, "ends at load factor 0.9"),
        ({"residual": 2e-6}, "residual 2.00e-06"),
        ({"energy": energies(internal=0.94)}, "ledger open by 6.0%"),
    ],
)
def test_what_is_outside_of_its_limits_is_found(whole, plain_scene, made, said):
    assert faults(whole(**made), plain_scene) == [said]


def test_hourglass_modes_are_found_where_elements_have_them(whole, plain_scene):
    dataset = whole(energy=energies(hourglass=0.06))
    assert faults(dataset, plain_scene) == []  # a network has none, and no limit of them
    solid = plain_scene.vary({"fidelity": "hexahedra"})
    assert faults(dataset, solid) == ["hourglass energy 6.4%"]


def test_penetration_is_held_against_what_contact_allows(whole, plain_scene):
    deep = whole(smallest_gap=(1e-5, -1e-6, -2e-5))
    assert faults(deep.assign_attrs(penetration_limit=3e-5), plain_scene) == []
    (said,) = faults(deep.assign_attrs(penetration_limit=1e-5), plain_scene)
    assert said == "penetration 2.00e-05 m, allowed 1.00e-05 m"
    assert faults(deep, plain_scene) == []  # beams: by their radius alone
    through = whole(smallest_gap=(0.0, 0.0, -1.01 * DEEPEST * plain_scene.yarn.radius))
    assert faults(through, plain_scene)[0].startswith("penetration ")
    assert faults(whole(smallest_gap=(np.nan, np.nan, np.nan)), plain_scene) == []


def test_nothing_is_said_of_a_ledger_of_rounding(whole, plain_scene):
    open_one = whole(energy=1e-15 * energies(internal=0.5))
    assert is_unloaded(open_one, plain_scene)
    assert faults(open_one, plain_scene) == []


def test_forces_of_contact_add_up_to_nothing(whole):
    force = np.zeros((3, 2, 3))
    force[-1] = [[0, 0, 1.0], [0, 0, -1.0]]
    dims = ("increment", "yarn_number", "xyz")
    assert unbalanced_contact(whole().assign(yarn_force=(dims, force))) == 0.0
    force[-1, 0, 2] = 1.2
    assert unbalanced_contact(whole().assign(yarn_force=(dims, force))) == pytest.approx(0.2 / 2.2)
    assert unbalanced_contact(whole().assign(yarn_force=(dims, 0 * force))) == 0.0
