"""A plectoneme: a twisted rod whose ends have come together winds around itself as a ply (Clauvelin et al. 2009)."""

import numpy as np
from book import slender
from curves import resampled
from scipy.optimize import brentq

from knitstudy.mechanics.beams.laws import Power
from knitstudy.mechanics.beams.rods import CLAMPED, End, Rods


def ply(angle, radius=1.0):
    """Return force F / B and moment M / B of a ply of two strands at an angle [rad] on a helix of a radius.

    Clauvelin, Audoly and Neukirch, Biophysical Journal 96 (2009) 3716.
    """
    s = np.sin(angle)
    force = s**3 * (np.cos(angle) * np.tan(2 * angle) - s / 2)
    return force / radius**2, 2 / np.sin(2 * angle) * (s**4 / 2 + force) / radius


def drawn(angle, length, tail=35.0, bend=7.0, clear=1.02):
    """Return a fine curve: two strands wind around the y axis for a `length`, a loop joins them, tails leave along x."""
    y = np.linspace(0, length, 6001)
    wind = y - bend / 2 * (1 - np.exp(-2 * y / bend))  # straight at first
    wind = np.tan(angle) / clear * wind
    right = np.column_stack([clear * np.cos(wind), y, clear * np.sin(wind)])
    turn = np.linspace(0, np.pi / 2, 1001)[1:]
    down = np.column_stack([clear + bend * (1 - np.cos(turn)), -bend * np.sin(turn), 0 * turn])
    out = down[-1] + np.linspace(0, tail, 2001)[1:, None] * [1.0, 0, 0]
    strand = np.concatenate([out[::-1], down[::-1], right])
    # A loop in the plane of the strands' ends: a pear from one to the other
    u = np.linspace(0, 1, 4001)[1:-1]
    across = np.array([np.cos(wind[-1]), 0, np.sin(wind[-1])])
    up = np.array([0, 1.0, 0])
    pear = (clear * np.cos(np.pi * u) + 4.0 * np.sin(np.pi * u) ** 2 * np.cos(np.pi * u))[:, None] * across
    pear = pear + length * up + (14.0 * np.sin(np.pi * u))[:, None] * up
    return np.concatenate([strand, pear, (strand * [-1, 1, -1])[::-1]])


if __name__ == "__main__":
    import sys
    import time

    a = np.radians(float(sys.argv[1]))
    size = float(sys.argv[2])
    per = int(sys.argv[3])
    k = float(sys.argv[4])
    n_ = float(sys.argv[5])
    curve = resampled(drawn(a, 50.0), lambda s: size + 0 * s)
    F, M = ply(a)
    sec = slender(1.0)
    rods = Rods([curve], 1.0, sec, Power(k, n_), natural=0.0, per_node=per)
    n = len(curve) - 1
    L = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    turn = M * L / sec.GJ
    # drawn from right tail to left tail: pull the first node to +x, the last to -x
    print(len(curve), F, M, turn)
    t = time.time()
    turn *= float(sys.argv[7])
    ends = {0: End(move=(float(sys.argv[6]), 0, 0), turn=(turn, 0, 0)), n: CLAMPED}
    try:
        for eq in rods.path(
            ends, 12, stride=0.5, residual_tolerance=1e-5, correction_tolerance=1e-4, waste=300
        ):
            m = eq.support[0, 3]
            f = eq.support[0, 0]
            known = ply(brentq(lambda b: ply(b)[0] - f, 1e-3, 0.7))[1] if f > 0 else np.nan
            print(eq.load, m, f, m / known - 1, time.time() - t, flush=True)
    except Exception as e:
        print(e)
    x = eq.curve()
    np.save("/tmp/w/plect.npy", x)
    pts = rods.contact.at_points(eq.state)
    pr = rods.contact.line.pairs(pts.position, np.zeros((2, 3)))
    print("overlap", (2 - pr.distance).max(), len(pr.i))
    import matplotlib.pyplot as plt

    f, ax = plt.subplots(1, 2, figsize=(12, 6))
    for y in (curve, x):
        ax[0].plot(y[:, 0], y[:, 1], ".-", ms=2, lw=0.5)
        ax[1].plot(y[:, 2], y[:, 1], ".-", ms=2, lw=0.5)
    ax[0].set_aspect("equal")
    ax[1].set_aspect("equal")
    plt.savefig("/tmp/w/p.png")
