"""A loop of yarn: drawn for its spacings, optimised, and drawn from the front."""

import matplotlib.pyplot as plt
import numpy as np

from knitstudy import load_scene
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out

jersey = {
    "pattern.course_spacing": 0.9e-3,  # m
    "pattern.wale_spacing": 1.1e-3,
    "pattern.loop_length": None,  # that of Peirce's loop
    "yarn.diameter": 0.25e-3,
}
dataset = lay_out(load_scene("stitches-plain-course").vary(jersey))
print(f"yarn in a loop: {1e3 * float(dataset['loop_length'][-1]):.2f} mm")
print(f"smallest gap: {1e6 * float(dataset['gap'][-1]):.1f} um")

fabric = fabric_of(dataset)
for yarn in fabric.centrelines:
    x, y, _ = 1e3 * yarn.position(np.linspace(0, yarn.length, 200)).T
    plt.plot(x, y, linewidth=6, solid_capstyle="round", alpha=0.7)
plt.gca().set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
plt.savefig("loop.png")
