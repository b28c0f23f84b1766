"""Knits from machine files: jersey, rib, half cardigan and jacquard, from knitout to force, strain and a picture."""

from pathlib import Path

import matplotlib.pyplot as plt

from knitstudy import load_scene, plot, simulate

FILES = Path("examples/knitout")
changes = {
    "pattern.wale_spacing": 3.3e-3,  # m, for which loops are drawn; those at rest are a result
    "pattern.course_spacing": 2.2e-3,
    "pattern.loop_length": None,
    "load.start": "rest",
    "load.strain": 0.3,
    "load.largest_force": None,
    "solver.increments": 8,
}
figure, axes = plt.subplots(1, 5, figsize=(15, 4), layout="constrained")
for panel, name in zip(axes[1:], ("jersey", "rib", "half_cardigan", "jacquard"), strict=True):
    knit = {"name": name, "knit": name, "pattern.knitout": str(FILES / f"{name}.k")}
    scene = load_scene("fabric-acrylic-rib-course-free").vary(knit | changes)
    results = simulate(scene)
    history = results.history
    per_width = history["force_per_width"].sel(plane="course")  # N/m
    print(f"{name} {list(scene.pattern.stitches)}: {float(per_width[-1]):.1f} N/m at 30 %")
    axes[0].plot(100 * history["strain"], per_width, "o-", label=name)
    plot(results, colour="u_z", axes=panel)
    panel.set_title(name)
axes[0].set(xlabel="strain [%]", ylabel="force per width [N/m]")
axes[0].legend()
figure.savefig("machine_knits.png")
