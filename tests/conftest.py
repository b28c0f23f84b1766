"""What tests of several kinds share: one small plain knit that needs no optimisation, and how processes share tests."""

import numpy as np
import pytest
from small_scenes import DEFAULTS

from knitstudy.geometry.fabric import plain_knit
from knitstudy.geometry.lay_out import initial_loop
from knitstudy.models.joints import contacts_of_crossings
from knitstudy.study.scene import Scene


def pytest_addoption(parser):
    group = parser.getgroup("verification")
    group.addoption("--full", action="store_true", help="run cases of verification at full resolution")
    group.addoption("--cases", action="store_true", help="collect only tests that record a case")
    group.addoption("--table", metavar="FILE", help="write the table of verification cases")


def pytest_collection_modifyitems(items):
    """Begin with the study that tests of the workflow look at; what waits for it comes last, other long tests first."""
    waiting = {item.path for item in items if {"finished", "finished_copy"} & set(item.fixturenames)}

    def place(item):
        longest = item.path.parent.name != "workflow"
        return item.path.name != "test_chain.py", item.path in waiting, longest

    items.sort(key=place)


@pytest.fixture(scope="session")
def plain_scene():
    """Scene of a 3 x 3 knit whose yarns just do not touch: an analytic loop of 39.3 mm of 1.8 mm yarn."""
    t = 2 * np.pi * np.arange(12) / 12
    wale, course, height = 10.15e-3, 7.85e-3, 13.52e-3
    x = wale * (t / (2 * np.pi) + 0.24 * np.sin(2 * t))
    points = np.column_stack([x, -height / 2 * np.cos(t), -1.135e-3 * np.cos(2 * t)])
    loop = {"course_spacing": course, "wale_spacing": wale, "control_points": points.tolist()}
    own = {
        "pattern": {"loops": 3, "rows": 3, "clearance": 0.02} | loop,
        "pair": DEFAULTS["pair"] | {"clearance": 0.02},
        "yarn": DEFAULTS["yarn"] | {"diameter": 1.8e-3},
        "geometry": DEFAULTS["geometry"] | {"beta": 1e-3, "free": [""] * 12, "samples": 100},
        "mesh": DEFAULTS["mesh"] | {"size": 0.45e-3},
        "solver": DEFAULTS["solver"] | {"increments": 4},
    }
    return Scene.from_dict(
        {"name": "plain-rom3d", "knit": "plain", "rom": {"contacts_from": "plain-dns"}},
        defaults=DEFAULTS | {"fidelity": "rom3d"} | own,
    )


@pytest.fixture(scope="session")
def knit_of():
    """Return the function that lays out the knit of a scene as its control points describe it."""
    return lambda scene: plain_knit(initial_loop(scene), scene.pattern.loops, scene.pattern.rows)


@pytest.fixture(scope="session")
def knit(plain_scene, knit_of):
    """Knit of the plain scene."""
    return knit_of(plain_scene)


@pytest.fixture(scope="session")
def contacts(knit):
    """Contacts of that knit, by geometry alone."""
    return contacts_of_crossings(knit)
