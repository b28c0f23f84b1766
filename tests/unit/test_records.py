"""Records of campaigns: made once, again where what they depend on has changed, and none is lost by an end."""

import pytest
from records import counted, record


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


def test_tasks_are_counted_with_the_time_that_is_left(capsys):
    assert list(counted([3, 4, 5], "trials")) == [3, 4, 5]
    first, second = capsys.readouterr().out.splitlines()
    assert first == "1 of 3 trials, about 0 min left"
    assert second == "2 of 3 trials, about 0 min left"
