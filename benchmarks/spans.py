"""Time of the tangents of spans, in one run with a large matrix product and with the material law at as many points.

    OMP_NUM_THREADS=1 python benchmarks/spans.py [--degrees 2 3 4] [--repeats 25]

All are measured in turn, in processor time. ``products`` is what the multiplications of the matrix products would take
at the speed of the large one, ``plain`` what B^T C B at every point would take, whose place sums over the section have.
The ``ratios`` are medians of the elements' time over the sum of the law and of either.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from knitstudy.mechanics.core.assembly import MANY
from knitstudy.mechanics.core.basis import quadrature, size
from knitstudy.mechanics.core.batches import serial_blas
from knitstudy.mechanics.materials.isotropic import Hencky
from knitstudy.mechanics.solids.spline_yarn.space import Space, yarn_space
from knitstudy.mechanics.solids.spline_yarn.span import span_groups

SPLINE, SPAN, BEND = 3, 0.9, 0.3  # degree along the yarn; length of a span and curvature in radii
LARGE = 1000  # rows of the large matrices


def main() -> None:
    """Measure the degrees that the command line asks for, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--degrees", type=int, nargs="+", default=[2, 3, 4])
    parser.add_argument("--repeats", type=int, default=25)
    options = parser.parse_args()
    print("degree  spans  large product (Gflop/s)  law (us a span)  products  plain  element  forces  ratios")
    with serial_blas():
        for degree in options.degrees:
            print(row(degree, options.repeats))


def row(degree: int, repeats: int) -> str:
    """Return one line of the table."""
    yarn = yarn_space(SPAN * np.arange(200), degree, SPLINE)
    s = np.linspace(0, yarn.spline.knots[-1], 2000)
    cos = np.cos(BEND * s)
    sin = np.sin(BEND * s)
    zero = 0 * s
    curves = (1 - cos, zero, sin), (cos, zero, -sin), (zero, zero + 1, zero)
    scales = 1 / BEND, 1, 1
    centre, *directors = (
        yarn.spline.fit(s, np.stack(c, axis=1) * f) for c, f in zip(curves, scales, strict=True)
    )
    nodes = yarn.coefficients(centre, *directors, 1.0)
    space = Space((yarn,))
    material = Hencky(1.0, 0.4)
    (group,) = span_groups(space, nodes, material)
    nodes_a_span = group.connectivity.shape[1]
    count = MANY // nodes_a_span**2  # as they come in one batch
    random = np.random.default_rng(0)
    moved = 0.01 * random.standard_normal((space.size, 3))[group.connectivity[:count]]
    out = np.empty((count, nodes_a_span**2, 9))
    strain = 0.03 * random.standard_normal((group.elements.points * count, 3, 3))
    strain += np.swapaxes(strain, 1, 2)
    rest, _ = material.without_dilatation()
    large = random.random((LARGE, LARGE))
    calls = (
        lambda: large @ large,
        lambda: rest.respond(strain, True),
        lambda: group.elements.respond(slice(0, count), moved, True, out),
        lambda: group.elements.respond(slice(0, count), moved, False),
    )
    seconds = np.array([[measured(call) for call in calls] for _ in range(repeats + 1)][1:]).T
    speed = 2 * LARGE**3 / seconds[0]
    law, element, forces = 1e6 * seconds[1:] / count
    products, plain = (1e6 * 2 * each(degree) / speed for each in (multiplications, plain_multiplications))
    medians = [np.median(each) for each in (1e-9 * speed, law, products, plain, element, forces)]
    shown = "  ".join(f"{each:.1f}" for each in medians)
    ratios = "  ".join(f"{np.median(element / (law + each)):.2f}" for each in (products, plain))
    return f"{degree}  {count}  {shown}  {ratios}"


def multiplications(degree: int) -> int:
    """Return the multiplications in the matrix products of one span's tangent and forces."""
    n = size(degree)
    g = SPLINE + 1
    d = SPLINE + 1
    m = len(quadrature(degree)[1])
    means = size(degree - 1)
    half = n * (n + 1) // 2
    moduli = g * m * (6 * 6 * 9 + 9 * 6 * 9)  # B^T C B
    across = g * m * 9 * (4 * half + 2 * n * n + half)  # sums of moduli over the section
    along = 4 * g * d * d * n * n * 9
    gradients = 2 * (2 * g * d * n * 3 + g * m * n * 9)  # and forces
    dilatation = g * m * 9 * n * means + 2 * g * d * 3 * n * means + means * (3 * d * n) ** 2
    return moduli + across + along + gradients + dilatation


def plain_multiplications(degree: int) -> int:
    """Return the multiplications of B^T C B (6 x 3 a, a nodes) and of the stress in one span's tangent."""
    nodes = (SPLINE + 1) * size(degree)
    return (SPLINE + 1) * len(quadrature(degree)[1]) * 3 * nodes * (6 * 6 + 6 * 3 * nodes + 3 + nodes)


def measured(call) -> float:
    """Return the processor time of a call."""
    started = time.process_time()
    call()
    return time.process_time() - started


if __name__ == "__main__":
    main()
