"""What the force of a fabric changes with: inputs a little larger, and a yarn that is no solid."""

from math import nan

import pytest
from click.testing import CliRunner

from knitstudy.errors import ConvergenceError, GeometryError
from knitstudy.run import inputs
from knitstudy.run.advice.problem import PhysicalProblem
from knitstudy.run.commands.main import main


def cubed(scene):
    """Force that grows with the third power of the diameter, and falls with the friction."""
    return 2.0 * scene.yarn.diameter**3 / scene.friction


def test_an_effect_is_a_power_of_the_input(jersey):
    base = cubed(jersey)
    effect = inputs.changed(jersey, "yarn.diameter", cubed).effect(base)
    assert effect.exponent == pytest.approx(3.0)
    assert effect.share == pytest.approx(1.1**3 - 1)
    assert str(effect) == "yarn.diameter +33 %"
    friction = inputs.changed(jersey, "contact.friction", cubed).effect(base)
    assert str(friction) == "contact.friction -9.1 %"
    assert inputs.largest([friction, None, effect]) == [effect, friction]


def test_a_loop_that_does_not_fit_is_drawn_for_less(jersey):
    def tight(scene):
        if scene.yarn.diameter > jersey.yarn.diameter:
            raise GeometryError("no loop fits")
        return cubed(scene)

    changed = inputs.changed(jersey, "yarn.diameter", tight)
    assert changed.factor < 1
    assert changed.effect(cubed(jersey)).exponent == pytest.approx(3.0)

    def never(scene):
        raise ConvergenceError("no balance")

    assert inputs.changed(jersey, "yarn.diameter", never).effect(1.0) is None
    assert inputs.Changed("yarn.diameter", 1.02, nan).effect(1.0) is None


def test_spacings_are_inputs_of_drawn_loops_alone(jersey):
    drawn = inputs.inputs_of(jersey)
    assert {"pattern.course_spacing", "yarn.diameter", "contact.friction"} <= set(drawn)
    assert "pattern.loop_length" not in drawn
    soft = {"yarn.bending": 1e-9, "mesh.section_law": "straight"}
    rest = jersey.vary({"load.start": "rest", "pattern.loop_length": 4.5e-3, **soft})
    of_rest = inputs.inputs_of(rest)
    assert not {*inputs.SPACINGS} & set(of_rest)
    assert {"pattern.loop_length", "yarn.bending"} <= set(of_rest)


def test_forces_of_the_jersey_change_with_diameter_and_spacing(jersey):
    """The jersey: of 1.02 d 54.3 for 51.5 N/m; beams of 0.3 R, 1.02 times the course spacing: 49.69 for 51.43."""
    effects = {effect.key: effect.exponent for effect in inputs.effects_on_force(PhysicalProblem(jersey))}
    assert effects["yarn.diameter"] == pytest.approx(2.64, rel=0.03)
    assert effects["pattern.course_spacing"] == pytest.approx(-1.74, rel=0.05)


def test_a_plan_is_of_the_simulation_and_names_inputs(jersey, tmp_path, monkeypatch):
    effect = inputs.Effect("yarn.diameter", 2.64)
    monkeypatch.setattr(inputs, "effects_on_force", lambda problem: [effect])
    planned = CliRunner().invoke(main, ["plan", "yarns-isotropic-course", "--accuracy", "0.5"])
    assert planned.exit_code == 0, planned.stderr
    _, taken, *rest = planned.stdout.splitlines()
    (told,) = [line for line in rest if "more of an input" in line]
    solid = rest[rest.index(told) + 1]
    assert ": error of the simulation at most " in taken
    assert " for the values you gave, on 75 % of the knits" in taken
    assert told.endswith("10 % more of an input: yarn.youngs_modulus +10 %, yarn.diameter +29 %")
    assert solid.startswith("the yarn is taken as a solid: it bends with ")


def test_the_bending_of_a_solid_yarn_stands_beside_that_of_a_spun_one(jersey):
    """E pi d4 / 64 of 200 MPa and 0.2 mm; cotton of 30 tex is 0.205 mm thick."""
    said = inputs.compared_with_library(jersey.vary({"yarn.diameter": 0.2e-3}))
    assert "it bends with 0.016 N mm2; cotton-30tex, 0.2 mm thick, with 0.001 (0.00058 to 0.86)" in said
