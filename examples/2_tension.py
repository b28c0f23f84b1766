"""A knit in tension: 3 x 3 tied cells as a network of beams, with and without tied areas that yield."""

import matplotlib.pyplot as plt

from knitstudy import load_scene, simulate

knit = load_scene("rom3d-tie-course").vary({"rom.contacts_from": None, "mesh.beam_size": 1.0})
for joint in ("rigid", "patch"):
    history = simulate(knit.replace("rom.joint", joint)).history
    plt.plot(100 * history["strain"], history["force"], label=f"joints: {joint}")
    print(f"{joint}: {float(history['force'][-1]):.1f} N at {float(history['strain'][-1]):.0%}")
plt.xlabel("strain [%]")
plt.ylabel("force [N]")
plt.legend()
plt.savefig("tension.png")
