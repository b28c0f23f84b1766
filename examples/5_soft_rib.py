"""A rib of soft acrylic yarn: a cell of beams that starts from its shape at rest and slides with friction."""

import matplotlib.pyplot as plt

from knitstudy import load_scene, simulate

changes = {"load.strain": 0.3, "solver.increments": 15, "load.largest_force": None}
scene = load_scene("fabric-acrylic-rib-course-free").vary(changes)
history = simulate(scene).history
print(f"yarn {1e3 * scene.yarn.diameter:.2f} mm, stitches {list(scene.pattern.stitches)}")
print(f"{float(history['force'][-1]):.4f} N at {float(history['strain'][-1]):.0%}")

plt.plot(100 * history["strain"], history["force"], "o-")
plt.xlabel("strain [%]")
plt.ylabel("force of one repeat [N]")
plt.savefig("rib.png")
