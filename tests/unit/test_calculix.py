import calculix
import numpy as np
import pytest

from knitstudy.errors import ConvergenceError, DataFileError

TOTALS = """
 total force (fx,fy,fz) for set RIGHT and time  0.1000000E+01

       1.234567E+00 -2.000000E-03  3.500000E-12

 total force (fx,fy,fz) for set RIGHT and time  0.2000000E+01

       2.500000E+00 -4.000000E-03  0.000000E+00
"""

STATUS = """SUMMARY OF JOB INFORMATION
  STEP      INC     ATT  ITRS     TOT TIME     STEP TIME      INC TIME
     1          1     1     3  0.100000E+01  0.100000E+01  0.100000E+01
     1          2     1U    9  0.200000E+01  0.200000E+01  0.100000E+01
     1          2     2     4  0.150000E+01  0.150000E+01  0.500000E+00
     2          1     1     5  0.250000E+01  0.100000E+01  0.100000E+01
"""


def test_totals_are_read(tmp_path):
    (tmp_path / "deck.dat").write_text(TOTALS)
    time, force = calculix.read_totals(tmp_path / "deck.dat")
    assert time.tolist() == [1.0, 2.0]
    np.testing.assert_array_equal(force, [[1.234567, -0.002, 3.5e-12], [2.5, -0.004, 0.0]])


def test_iterations_count_failed_attempts(tmp_path):
    (tmp_path / "deck.sta").write_text(STATUS)
    step, iterations = calculix.read_iterations(tmp_path / "deck.sta")
    assert step.tolist() == [1, 1, 2]
    assert iterations.tolist() == [3, 13, 5]


@pytest.mark.parametrize("reader", [calculix.read_totals, calculix.read_iterations])
def test_missing_and_empty_results_are_named(tmp_path, reader):
    with pytest.raises(DataFileError, match=r"deck\.out"):
        reader(tmp_path / "deck.out")
    (tmp_path / "deck.out").write_text("nothing\n")
    with pytest.raises(DataFileError, match=r"deck\.out"):
        reader(tmp_path / "deck.out")


@pytest.fixture
def failing(monkeypatch, tmp_path):
    """A program of CalculiX's name that prints an error and ends with status 201."""
    program = tmp_path / "ccx"
    program.write_text("#!/bin/sh\necho ' *ERROR reading *NODE:'\necho '        no such card'\nexit 201\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")


def test_an_error_of_calculix_is_passed_on(failing, tmp_path):
    (tmp_path / "deck.inp").write_text("*NODE\n")
    with pytest.raises(ConvergenceError, match=r"status 201: \*ERROR reading \*NODE: no such card"):
        calculix.run(tmp_path / "deck.inp")


def test_without_calculix_the_message_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert not calculix.available()
    with pytest.raises(DataFileError, match="ccx is not on the PATH"):
        calculix.run(tmp_path / "deck.inp")
