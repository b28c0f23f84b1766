"""A jersey of your own: one cell of an endless knit, pulled along its courses and along its wales."""

import matplotlib.pyplot as plt

from knitstudy import load_scene, simulate

jersey = {
    "pattern.course_spacing": 0.9e-3,  # m
    "pattern.wale_spacing": 1.1e-3,
    "pattern.loop_length": None,
    "yarn.diameter": 0.25e-3,
    "yarn.youngs_modulus": 200e6,  # Pa, of the yarn as a solid
    "load.strain": 0.03,
}
for direction in ("course", "wale"):
    scene = load_scene(f"stitches-plain-{direction}").vary(jersey)
    history = simulate(scene).history
    width = 0.9e-3 if direction == "course" else 1.1e-3  # one row, or one wale
    per_width = history["force"] / width
    print(f"{direction}: {float(per_width[-1]):.0f} N/m at {float(history['strain'][-1]):.0%}")
    plt.plot(100 * history["strain"], per_width, "o-", label=direction)
plt.xlabel("strain [%]")
plt.ylabel("force per width [N/m]")
plt.legend()
plt.savefig("jersey.png")
