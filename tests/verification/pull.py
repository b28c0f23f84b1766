"""Pull a knit in a process of its own: ``python pull.py SCENE FORCES CHECKPOINT [key=value ...] [kill=INCREMENT]``.

Writes the force curve to FORCES (npy); with ``kill`` the process ends itself by SIGKILL once that increment has
converged, as a power cut would.
"""

import json
import os
import signal
import sys

import numpy as np

from knitstudy import dns
from knitstudy.configuration import load_scene
from knitstudy.geometry.build import build
from knitstudy.geometry.pattern import Knit
from knitstudy.mesh.knit import mesh_knit


def knit_and_mesh(scene):
    """Knit and mesh of a scene."""
    knit = Knit.from_dataset(build(scene))
    return knit, mesh_knit(knit, scene.mesh.size, scene.mesh.growth)


def main(name, forces, checkpoint, *options):
    scene, kill = load_scene(name), None
    for key, value in (option.split("=") for option in options):
        if key == "kill":
            kill = int(value)
        else:
            scene = scene.replace(key, json.loads(value))

    def watch(increment):
        print("increment", increment.index, flush=True)
        if increment.index == kill:
            os.kill(os.getpid(), signal.SIGKILL)

    knit, mesh = knit_and_mesh(scene)
    history = dns.run(scene, mesh, knit, checkpoint=checkpoint, progress=watch)
    np.save(forces, history["force"].to_numpy())


if __name__ == "__main__":
    main(*sys.argv[1:])
