"""Friction: beams in contact that slide on each other, for three coefficients of friction."""

import matplotlib.pyplot as plt

from knitstudy import load_scene, simulate

changes = {
    "pattern.loops": 1,
    "pattern.rows": 3,
    "mesh.beam_size": 1.5,  # yarn radii
    "load.strain": 0.02,
    "load.stops": [],
    "solver.increments": 8,
}
knit = load_scene("beam-isotropic-course").vary(changes)
for friction in (0.1, 0.3, 0.76):
    history = simulate(knit.replace("contact.friction", friction)).history
    lost = float(history["energy"].sel(form="friction")[-1])
    print(f"friction {friction}: {float(history['force'][-1]):.2f} N, {1e6 * lost:.1f} uJ lost")
    plt.plot(100 * history["strain"], history["force"], label=f"friction {friction}")
plt.xlabel("strain [%]")
plt.ylabel("force [N]")
plt.legend()
plt.savefig("friction.png")
