"""Banded Cholesky factors by LAPACK, outside of the interpreter's lock.

SciPy's own wrappers of these routines keep the lock, so that threads wait for each other; the addresses that SciPy
gives to Cython, called through `ctypes`, do not.
"""

from __future__ import annotations

import ctypes

import numpy as np
from scipy.linalg import cython_lapack

LETTER = {np.dtype(np.float32): "s", np.dtype(np.float64): "d"}
"""LAPACK's letter of a precision."""


def factorise(band: np.ndarray) -> int:
    """Replace a lower band by its Cholesky factor.

    Parameters
    ----------
    band : ndarray, shape (bandwidth + 1, n), Fortran order
        Diagonal and lower diagonals in single or double precision.

    Returns
    -------
    int
        0, or the order of the leading minor that is not positive definite.
    """
    rows, n = band.shape
    info = ctypes.c_int()
    _PBTRF[band.dtype](b"L", _int(n), _int(rows - 1), band.ctypes.data, _int(rows), ctypes.byref(info))
    return info.value


def solve(factor: np.ndarray, rhs: np.ndarray) -> None:
    """Replace a right-hand side (n,) by the solution for a factor that `factorise` has left, in its precision."""
    rows, n = factor.shape
    info = ctypes.c_int()
    _PBTRS[factor.dtype](
        b"L",
        _int(n),
        _int(rows - 1),
        _int(1),
        factor.ctypes.data,
        _int(rows),
        rhs.ctypes.data,
        _int(n),
        ctypes.byref(info),
    )


def _int(value: int) -> ctypes._SimpleCData:
    return ctypes.byref(ctypes.c_int(value))


def _routine(name: str, arguments: int) -> ctypes._CFuncPtr:
    """Return a routine of LAPACK that takes pointers."""
    capsule = cython_lapack.__pyx_capi__[name]
    name_of = ctypes.pythonapi.PyCapsule_GetName
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address_of = ctypes.pythonapi.PyCapsule_GetPointer
    address_of.restype, address_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    kind = ctypes.CFUNCTYPE(None, ctypes.c_char_p, *[ctypes.c_void_p] * (arguments - 1))
    return kind(address_of(capsule, name_of(capsule)))


_PBTRF = {dtype: _routine(f"{letter}pbtrf", 6) for dtype, letter in LETTER.items()}
_PBTRS = {dtype: _routine(f"{letter}pbtrs", 9) for dtype, letter in LETTER.items()}
