"""Two yarns in one fabric: contact of unlike cylinders and layers, friction, and cells of alternate courses."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from half_spaces import hertz, hertz_ellipse, stick_stiffness, surface
from refusals import refusal
from scipy.special import beta
from test_line_contact import FAR_AWAY, NU, D, forces, path, walk

from knitstudy.knit.geometry.fabric import of_curves
from knitstudy.knit.geometry.fabric_file import fabric_dataset, fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.models.beam.cell import OfYarns
from knitstudy.knit.models.beam.rest import relax
from knitstudy.knit.simulate import simulate
from knitstudy.measures.construction import at_rest
from knitstudy.mechanics.beams.beam import BeamSection, BeamState, LineHistory
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.beams.contact_points import ContactPoints
from knitstudy.mechanics.beams.laws import CrossedCylinders, Mixed, Power, Repulsion
from knitstudy.mechanics.beams.line_contact import LineContact
from knitstudy.mechanics.cells.beams import EndlessBeams
from knitstudy.mechanics.cells.lattice import Lattice
from knitstudy.run.configuration import load_scene

KNOWN = yaml.safe_load(Path(__file__).with_name("endless_beams.yaml").read_text())
KEYS = KNOWN["beams"]
DEEP = 0.0025  # approach over the sum of the radii, 1


def radii(ratio):
    """Radii of both yarns, the first one the thicker, of the sum `D`."""
    return D / (1 + ratio) * np.array([1.0, ratio])


def pair(laws, ratio=1.0, bends=(0.0, 0.0), angle=90.0, spacing=0.025, friction=0.0, deep=DEEP, half=None):
    """Two yarns pressed by `deep`, of the curvatures `bends` over 2 / D towards each other."""
    half = half or (0.6 if any(bends) or angle > 44 else 1.2)
    s = np.arange(-half, half, spacing) + 0.3 * spacing
    lower, upper = (
        np.column_stack([np.sin(k * s) / k, 0 * s, (1 - np.cos(k * s)) / k]) if k else s[:, None] * [1, 0, 0]
        for k in 2 * np.array(bends) / D
    )
    c, n = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    upper = upper @ np.array([[c, n, 0], [-n, c, 0], [0, 0, -1.0]]) + [0, 0, D - deep]
    yarn, thick = np.repeat([0, 1], len(s)), 2 * radii(ratio)
    # The onset of a pair is that of the first yarn over the mean thickness
    law = Mixed.of_yarns(laws, thick.tolist(), 2 * spacing**2 / thick[0], yarn)
    contact = LineContact(yarn, np.tile(s, 2), np.full(2 * len(s), spacing), law, friction)
    return contact, np.concatenate([lower, upper]), yarn


def carried(*given, **keys):
    """Return the force of one yarn on the other, the mean over places of points of the upper one."""
    total = []
    for shift in (0.0, 0.5):
        model, points, yarn = pair(*given, **keys)
        tangent = np.gradient(points[yarn == 1], axis=0)
        points[yarn == 1] += shift * tangent
        total.append(-forces(model, points)[0][:-6].reshape(-1, 6)[yarn == 1, 2].sum())
    return float(np.mean(total))


def gap(x, y, ratio, bends, angle):
    """Return the gap of both surfaces over their common tangent plane, of the sum of radii `D`."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    (one, other), (k, q) = radii(ratio), 2 * np.array(bends) / D
    return -one * surface(x / one, y / one, k * one) - other * surface(
        (c * x + s * y) / other, (c * y - s * x) / other, q * other
    )


def hertzian(moduli, ratio, bends, angle, deep=DEEP):
    """Force, semi-axes and directions of Hertz's ellipse; the compliances of both half spaces add."""
    i, j, step = [1e-3, 0], [0, 1e-3], 1e-3

    def second(a, b):
        at = [np.add(a, b), np.subtract(a, b), np.subtract(b, a), -np.add(a, b)]
        one, two, three, four = (gap(*place, ratio, bends, angle) for place in at)
        return (one - two - three + four) / (4 * step**2)

    (flat, steep), axes = np.linalg.eigh([[second(i, i), second(i, j)], [second(j, i), second(j, j)]])
    force, a, b = hertz_ellipse(flat, steep, deep, NU)
    return force * 2 / np.sum(1 / np.array(moduli)), a, b, axes.T


def halves(moduli, ratio):
    """Return Hertz's laws of both yarns with themselves."""
    return tuple(hertz_law(E, R) for E, R in zip(moduli, radii(ratio), strict=True))


def hertz_law(modulus, radius):
    """Hertz's law without the finite thickness of a cylinder: small patches."""
    known, law = CrossedCylinders.elastic(modulus, NU, radius), hertz(modulus, NU, radius)
    return type(known)(law.coefficient, 1.5, law.share, law.patch, radius=radius, table=ONE)


def ONE(x, order=0):
    """F over Hertz's."""
    return np.ones_like(x) if order == 0 else np.zeros_like(x)


ONE.x = np.array([0.0, 1.0])

UNLIKE = [
    ((1.0, 1.0), 0.8), ((1.0, 1.0), 0.5), ((1.0, 10.0), 1.0), ((1.0, 0.1), 0.5), ((3.0, 1.0), 0.65),
]  # fmt: skip
SHAPES = [
    (90, (0, 0)),
    (60, (0, 0)),
    (30, (0, 0)),
    (90, (0.2, 0.2)),
    (90, (0.4, 0.1)),
    (60, (0.1, 0.2)),
    (60, (0.3, -0.2)),
]


@pytest.mark.parametrize(("angle", "bends"), SHAPES)
@pytest.mark.parametrize(("moduli", "ratio"), UNLIKE)
def test_unlike_cylinders_carry_what_hertz_says(moduli, ratio, angle, bends):
    """Elliptic patches of half spaces of two moduli and two radii (Johnson 1985, section 4.2)."""
    actual = carried(halves(moduli, ratio), ratio, bends, angle)
    assert actual == pytest.approx(hertzian(moduli, ratio, bends, angle)[0], rel=0.015)


@pytest.mark.parametrize(("angle", "bends"), [(90, (0, 0)), (60, (0, 0)), (90, (0.2, 0.2)), (60, (0.1, 0.2))])
def test_unlike_cylinders_that_stick_are_as_stiff_as_mindlin_says(angle, bends):
    ratio, size = 0.5, 1e-5
    _, a, b, axes = hertzian((1, 1), ratio, bends, angle)
    for axis, expected in zip(axes, stick_stiffness(a, b, NU), strict=True):
        pull = np.zeros(2)
        model, points, yarn = pair(halves((1, 1), ratio), ratio, bends, angle, 0.0125, friction=1e3)
        turn = np.tile(np.eye(3), (len(yarn), 1, 1))
        history = model.commit(BeamState(points, turn), FAR_AWAY, LineHistory.none())
        for sign in (1, -1):
            state = BeamState(points + sign * size * (yarn == 1)[:, None] * np.append(axis, 0.0), turn)
            for row, past in enumerate((history, LineHistory.none())):
                force = model.respond(state, FAR_AWAY, past, False)[0]
                pull[row] += sign * force[:-6].reshape(-1, 6)[yarn == 1, :2].sum(axis=0) @ axis
        assert (pull[0] - pull[1]) / (2 * size) == pytest.approx(expected, rel=0.02)


LAWS = {
    "one": (Power(1.0, 2.5), Power(1.0, 2.5)),
    "stiffer": (Power(1.0, 2.5), Power(20.0, 2.5)),
    "cotton and nylon": (Power(50.0, 2.5), Power(3.0, 2.9)),
}


@pytest.mark.parametrize(
    ("angle", "bends", "deep", "bar"),
    [(90, (0, 0), 0.05, 0.03), (45, (0, 0), 0.05, 0.03), (90, (0.2, 0.2), 0.01, 0.03)],
)
@pytest.mark.parametrize("ratio", [1.0, 0.8, 0.5])
@pytest.mark.parametrize("name", LAWS)
def test_unlike_layers_give_way_in_series(name, ratio, angle, bends, deep, bar):
    """Sum of the pressure at which both layers share the overlap of two tori, each by its own power."""
    laws, R = LAWS[name], radii(ratio)
    hard = [law.coefficient * law.exponent / (2 * np.pi * r) for law, r in zip(laws, R, strict=True)]

    def overlap(p):
        return sum(0.5 * (p / k) ** (1 / (law.exponent - 1)) for k, law in zip(hard, laws, strict=True))

    x = np.linspace(-0.98, 0.98, 800) * R.min()
    x, y = np.meshgrid(x, x, indexing="ij")
    with np.errstate(invalid="ignore"):
        depth = np.nan_to_num(np.maximum(deep - gap(x, y, ratio, bends, angle), 0.0))
    p = np.geomspace(1e-12, 1e3, 4000) * max(hard)
    expected = np.interp(depth, overlap(p), p).sum() * (x[1, 0] - x[0, 0]) ** 2
    actual = carried(laws, ratio, bends, angle, deep=deep)
    fitted = 0.03 if laws[0].exponent != laws[1].exponent else 0.0  # a power for the law of both
    assert actual == pytest.approx(expected, rel=bar + fitted)


@pytest.mark.parametrize("exponent", [1.5, 2.5])
@pytest.mark.parametrize("ratio", [1.0, 0.8, 0.5])
def test_parallel_layers_carry_their_pressure_over_the_width_of_their_contact(ratio, exponent):
    """p = k u^m over the overlap u = delta - x^2 / 2R' with 1/R' = 1/R_a + 1/R_b; of equal yarns it is 3 to 4 % off."""
    laws, deep, m, R = 2 * (Power(1.0, exponent),), 0.05, exponent - 1, radii(ratio)
    k = np.sum(0.5 * (exponent / (2 * np.pi * R)) ** (-1 / m)) ** -m
    expected = k * deep**m * np.sqrt(2 * R.prod() / R.sum() * deep) * beta(0.5, m + 1)
    model, points, yarn = pair(laws, ratio, angle=0.0, deep=deep, half=2.0)
    middle = (yarn == 1) & (np.abs(points[:, 0]) < 0.5)
    force = -forces(model, points)[0][:-6].reshape(-1, 6)[middle, 2].sum()
    assert force / (middle.sum() * 0.025) == pytest.approx(expected, rel=0.04)


def test_laws_that_make_no_power_together_are_refused():
    with refusal("yarn_b.pressing_exponent is 2.9 and that of yarn 1.7"):
        pair((Power(1.0, 1.7), Power(3.0, 2.9)))


@pytest.mark.parametrize("friction", [0.2, 1e3])
def test_no_cycle_gives_work_back(friction):
    """Two yarns of unlike thickness and law: friction loses energy in every increment, in the end all of the work."""
    rng = np.random.default_rng(1)
    corners = np.column_stack([rng.uniform(-0.01, 0.01, (8, 2)), rng.uniform(-0.04, 0.01, 8)])
    places = path([0, 0, -0.01], *corners, [0, 0, -0.01], [0, 0, 0.06], steps=5)
    keys = {"ratio": 0.6, "bends": (0.15, 0.15), "angle": 60, "spacing": 0.05, "deep": 0.0}
    laws = halves((1.0, 5.0), 0.6)
    steps, smooth = (list(walk(*pair(laws, friction=mu, **keys), places)) for mu in (friction, 0.0))
    pull = np.array([one[0] - other[0] for one, other in zip(steps, smooth, strict=True)])
    lost = [each for _, _, energy, history in steps for each in (energy["friction"], history.dissipated)]
    work = 0.5 * np.sum((pull[1:] + pull[:-1]) * np.diff(places, axis=0))
    assert np.diff(lost).min() > -1e-12 * max(lost)
    assert lost[-1] > 0
    assert work == pytest.approx(lost[-1], rel=0.4)
    assert steps[-1][-1].stored.sum() == 0


def straight_rows(moduli, straight=0.0):
    """A cell of two straight rows 3 apart, of beams of different stiffness."""
    n, own = 8, 4.0
    s = np.arange(n) * own / n
    owner, image = np.append(np.arange(2 * n), [0, n]), np.zeros((2 * n + 2, 2), dtype=int)
    image[-2:, 0] = 1
    lattice = Lattice(np.array([[own, 0, 0], [0, 6.0, 0]]))
    nodes = np.concatenate([np.column_stack([s, 0 * s + 3 * k, 0 * s]) for k in (0, 1)])
    nodes = nodes[owner] + image @ lattice.vectors
    ends = np.concatenate(
        [np.column_stack([np.arange(n), np.append(np.arange(1, n), -1)]) + k * n for k in (0, 1)]
    )
    ends[n - 1, 1], ends[-1, 1] = 2 * n, 2 * n + 1
    yarn = np.repeat([0, 1], n)
    section = OfYarns([BeamSection(E, E, 0.01 * E, 0.01 * E) for E in moduli], yarn)
    period = np.full(2, own)
    points = ContactPoints.of(yarn, np.tile(s, 2), 1, period)
    line = LineContact(
        points.yarn, points.arc_length, points.weight, Repulsion(Power(1.0), 1.0, 0.02), period=period
    )
    inner = BeamModel(nodes, ends, section, 0.5)
    return EndlessBeams(inner, owner, image, lattice, line, points, straight=straight)


def test_straight_rows_carry_the_sum_of_both():
    """EA e of a row and the other; the strain of the lattice moves all nodes evenly."""
    model = straight_rows((50.0, 7.0))
    step = np.zeros(model.size)
    step[-3] = 0.02 * 4.0
    step[: 6 * 16].reshape(-1, 6)[:, 0] = 0.02 * np.tile(np.arange(8) * 0.5, 2)
    pull = model.respond(model.advance(model.start(), step), False).force[-3]
    assert pull == pytest.approx(57.0 * 0.02, rel=1e-4)  # and the drag


def test_a_straight_yarn_that_nothing_touches_is_held_within_an_increment_alone():
    """It drags by 0.01 EI / L^3 of its length as it moves, and does not turn about itself; an increment ends that."""
    model, moved = straight_rows((50.0, 7.0), straight=np.full(16, 4.0)), 0.3
    loose, held = (
        np.linalg.eigvalsh(each.respond(each.start(), True).stiffness.toarray()[:-3, :-3]).min()
        for each in (straight_rows((50.0, 7.0)), model)
    )
    assert abs(loose) < 1e-6 * held
    step = np.zeros(model.size)
    step[:48:6] = moved
    state = model.advance(model.start(), step)
    drag = 0.01 * (0.01 * 0.5 * (50.0 + 7.0)) / 4.0**3
    assert model.respond(state, False).force[:48:6].sum() == pytest.approx(drag * moved, rel=1e-9)
    begun = model.begin(model.commit(state), 0.5, 0.1)
    assert np.abs(model.respond(begun, False).force).max() < 1e-12


def ends_of(keys, scene="stitches-plain-course"):
    """Return the history of a small cell of two rows, at a small strain."""
    small = {"pattern.rows": 2, "load.lateral": "free", "contact.friction": 0.3, "mesh.beam_size": 0.6}
    scene = load_scene(scene).vary(KEYS | small | keys)
    return simulate(scene, lay_out(scene))


def pull_of(keys, way="course"):
    """Return the force per width along the load at its end."""
    return float(ends_of({"load.deformation": way} | keys).force_per_width[-1, int(way == "wale")])


E, SOFT = 1.3e9, 0.2e9  # of the scene, and of a softer yarn


def test_two_yarns_of_equal_values_are_one_yarn():
    one, both = (ends_of(keys) for keys in ({}, {"yarn_b.youngs_modulus": E, "yarn_b.diameter": 0.2e-3}))
    for name in ("force_per_width", "cell_strain", "centreline_displacement", "energy", "largest_overlap"):
        within = 1e-8 * float(abs(one[name]).max())
        np.testing.assert_allclose(both[name], one[name], atol=within, rtol=0)


def test_rows_of_the_second_yarn_alone_are_its_fabric():
    """A thinner and softer yarn in loops that were drawn for the first one, beside a scene of it in the same loops."""
    small = {"pattern.rows": 2, "load.lateral": "free", "contact.friction": 0.3, "mesh.beam_size": 0.5}
    small |= {"load.strain": 0.06, "solver.increments": 4}
    first = load_scene("stitches-plain-course").vary(KEYS | small)
    geometry, thin = lay_out(first), 0.9 * first.yarn.diameter
    second = first.vary({"yarn_b.diameter": thin, "yarn_b.youngs_modulus": SOFT, "yarn_b.rows": ["b"]})
    alone = {"yarn.diameter": thin, "yarn.youngs_modulus": SOFT, "mesh.beam_size": 0.5 / 0.9}
    both, one = (simulate(scene, geometry) for scene in (second, first.vary(alone)))
    for name in ("force_per_width", "cell_strain", "energy"):
        within = 1e-4 * float(abs(one[name]).max())
        np.testing.assert_allclose(both[name], one[name], atol=within, rtol=0)
    # In radii: yarns hardly overlap, and Newton's tolerance leaves them a millionth
    np.testing.assert_allclose(both["largest_overlap"], one["largest_overlap"], atol=1e-6, rtol=0)
    assert one.force_per_width.values[-1, 0] > 0


@pytest.mark.parametrize("way", ["course", "wale"])
def test_stripes_carry_more_than_the_soft_yarn_and_at_most_the_mean_of_both(way):
    """An even strain of both is no balance: it bounds the energy from above. Rows may begin with either yarn."""
    stiff, soft, first, other = (
        pull_of(keys, way)
        for keys in (
            {},
            {"yarn.youngs_modulus": SOFT},
            {"yarn_b.youngs_modulus": SOFT},
            {"yarn_b.youngs_modulus": SOFT, "yarn_b.rows": ["b", "a"]},
        )
    )
    assert soft == pytest.approx(stiff * SOFT / E, rel=1e-6)
    assert 1.5 * soft < first < 0.5 * (stiff + soft)
    assert other == pytest.approx(first, rel=1e-5)  # tolerance of balance, which friction remembers


def test_a_thinner_second_yarn_makes_a_slacker_fabric_that_balances_its_energy():
    """Friction loses energy in every increment; the sum of all forms is the work."""
    history = ends_of({"yarn_b.diameter": 0.18e-3, "load.strain": 0.06, "solver.increments": 8})
    external, *others = history.energy.values[-1]
    assert external == pytest.approx(sum(others), rel=0.02)
    assert np.diff(history.energy.sel(form="friction")).min() >= -1e-12 * np.abs(history.energy.values).max()
    assert 0 < history.force_per_width.values[-1, 0] < pull_of({"load.strain": 0.06, "solver.increments": 8})


EA = 50.0  # of the inlay [N]
RIB = KNOWN["soft yarn"] | {
    "interaction": "isotropic",
    "pattern.stitches": ["KP"],
    "pattern.loops": 2,
    "pattern.rows": 1,
    "geometry.diameter_share": 0.5,
    "yarn.set": 1.0,
    "gates.flow": 10.0,
    "load.strain": 0.02,
    "solver.increments": 4,
}
LAID = {"yarn_b.rows": ["a", "inlay"], "yarn_b.stretching": EA}


def rib(laid, **keys):
    """Return rest and history of a rib with an inlay, or of the same loops without it."""
    scene = load_scene("stitches-plain-course").vary(RIB | LAID | keys)
    geometry = lay_out(scene)
    if not laid:
        scene, of = load_scene("stitches-plain-course").vary(RIB | keys), fabric_of(geometry)
        more = {"specimen": "cell", "periods": of.periods, "cell": of.cell}
        rows = of.centrelines[0], of.centrelines[2]
        alone = of_curves(rows, of.radius, of.clearance, of.size, np.array([0, 0]), of.shift[[0, 2]], **more)
        geometry = fabric_dataset(alone)
    rest = relax(scene, geometry)
    return rest, simulate(scene, geometry, rest=rest)


def test_an_inlay_lies_straight_in_a_rib_at_rest_and_adds_its_stretch():
    """F = EA ((1 + e) W / L - 1) / c, of an inlay of length L in a cell as wide as W: the rib adds a thousandth."""
    rest, history = rib(True)
    width, height = (history.attrs[name] for name in ("cell_width", "cell_height"))
    yarn, length = history["yarn"].values, 2 * RIB["pattern.wale_spacing"]
    inlay = rest["centreline"].values[yarn == 1]
    assert set(yarn) == {0, 1}
    numbers = {number.name: number.value for number in at_rest(history, 2, 1, 0.25e-3)}
    assert numbers["length of yarn in a stitch"] == pytest.approx(11.28, rel=0.01)  # of the loops alone
    assert np.ptp(inlay[:, 1:], axis=0).max() < 0.1 * RIB["yarn.diameter"]
    strain = history.cell_strain.values[:, 0]
    pull = EA * ((1 + strain) * width / length - 1) / height
    assert history.force_per_width.values[1:, 0] == pytest.approx(pull[1:], rel=3e-3)
    energy = history.energy
    assert np.diff(energy.sel(form="friction")).min() >= -1e-12 * float(np.abs(energy).max())
    assert float(energy.sel(form="stabilisation")[-1]) < 1e-6 * float(energy.sel(form="internal")[-1])


def test_an_inlay_without_friction_carries_nothing_along_the_wales_but_holds_the_width():
    """The same rib at the same width and course spacing, with it and without: 3 to 8 % less force with it.

    Without it the rib rests with rows nearer to each other, and becomes narrower as it is pulled.
    """
    keys = {"load.deformation": "wale", "contact.friction": 0.0, "solver.increments": 8}
    laid = rib(True, **keys, **{"load.strain": 0.3})[1]
    bare = rib(False, **keys, **{"load.strain": 0.5624, "load.lateral": "fixed"})[1]
    (high, force), without = (
        (of.attrs["cell_height"] * (1 + of.cell_strain.values[:, 1]), of.force_per_width.values[:, 1])
        for of in (laid, bare)
    )
    there = high > 2.2e-3  # where loops are taut
    assert there.sum() >= 3
    assert force[there] == pytest.approx(np.interp(high[there], *without), rel=0.1)
    assert np.abs(laid.cell_strain.values[:, 0]).max() < 1e-3
