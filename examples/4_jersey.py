"""A jersey of your own: one cell of an endless knit, pulled along its courses and along its wales."""

import matplotlib.pyplot as plt

from knitstudy import CellStrain, Pattern, SolidYarn, TiedCellOfSplineYarns, simulate

pattern = Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1)  # m
yarn = SolidYarn(diameter=0.25e-3, youngs_modulus=200e6)  # m; Pa, of the yarn as a solid
for direction, width in (("course", 0.9e-3), ("wale", 1.1e-3)):  # of one row, or one wale [m]
    load = CellStrain(deformation=direction, strain=0.03, lateral="free")
    history = simulate(TiedCellOfSplineYarns(pattern=pattern, yarn=yarn, load=load)).history
    per_width = history["force"] / width
    print(f"{direction}: {float(per_width[-1]):.0f} N/m at {float(history['strain'][-1]):.0%}")
    plt.plot(100 * history["strain"], per_width, "o-", label=direction)
plt.xlabel("strain [%]")
plt.ylabel("force per width [N/m]")
plt.legend()
plt.savefig("jersey.png")
