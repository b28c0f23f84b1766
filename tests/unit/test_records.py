"""Records of campaigns: made once, again where what they depend on has changed, and none is lost by an end."""

import pytest
import swatches
from records import code_of, counted, record


def test_a_record_is_made_once_for_what_it_depends_on(tmp_path):
    made = []

    def make():
        made.append(len(made))
        return {"force [N]": 1.5, "number": made[-1]}

    assert record(tmp_path, "a", ["behaviour", {"strain": 0.1}], make)["number"] == 0
    assert record(tmp_path, "a", ["behaviour", {"strain": 0.1}], make) == {"force [N]": 1.5, "number": 0}
    assert record(tmp_path, "a", ["moved", {"strain": 0.1}], make)["number"] == 1
    assert record(tmp_path, "b", ["moved", {"strain": 0.1}], make)["number"] == 2
    assert record(tmp_path, "a", ["behaviour", {"strain": 0.1}], make)["number"] == 0


def test_a_run_that_is_ended_leaves_no_record(tmp_path):
    def ended():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(tmp_path, "a", 1, ended)
    assert list(tmp_path.iterdir()) == []


def test_time_that_is_left_is_by_tasks_that_ran(capsys):
    """Two records are read at once, then each run takes ten minutes."""
    now = [0.0]
    for number in counted(range(5), "trials", lambda: now[0]):
        now[0] += 600.0 if number >= 2 else 0.001
    assert capsys.readouterr().out.splitlines() == [
        "1 of 5 trials",
        "2 of 5 trials",
        "3 of 5 trials, about 20 min left",
        "4 of 5 trials, about 10 min left",
        "5 of 5 trials",
    ]


def test_code_of_a_script_is_its_statements(tmp_path):
    script = tmp_path / "script.py"
    codes = []
    for text in ("TEX = 30\n", "TEX = 30  # of the yarn\n", "TEX = 60\n"):
        script.write_text(text)
        codes.append(code_of(str(script)))
    assert codes[0] == codes[1] != codes[2]


@pytest.mark.parametrize("changed", ["scene", "behaviour", "code", None])
def test_shapes_of_swatches_depend_on_scene_behaviour_and_script(monkeypatch, changed):
    before = swatches.shape_depends_on("rule", ("K",), 0.1)
    if changed == "scene":
        scene = swatches.load_scene(swatches.SCENE).vary({"solver.increments": 7})
        monkeypatch.setattr(swatches, "load_scene", lambda name: scene)
    if changed == "behaviour":
        monkeypatch.setattr(swatches, "behaviour", lambda groups: "moved")
    if changed == "code":
        monkeypatch.setattr(swatches, "code_of", lambda *files: "TEX = 60")
    assert (swatches.shape_depends_on("rule", ("K",), 0.1) == before) == (changed is None)
