"""Pull a knit in a process of its own: ``python pull.py SCENE HISTORY CHECKPOINT [key=value ...] [kill=INCREMENT]``.

Writes the history to HISTORY (netCDF); with ``kill`` the process ends itself by SIGKILL once that increment has
converged, as a power cut would.
"""

import json
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path

from knitstudy.files import write_dataset
from knitstudy.geometry.fabric import Fabric
from knitstudy.geometry.lay_out import lay_out
from knitstudy.loading.restart import Run
from knitstudy.mesh.mesher import mesh_scene
from knitstudy.models.simulate import solve
from knitstudy.study.configuration import load_scene


def knit_and_mesh(scene):
    """Knit and mesh of a scene."""
    knit = Fabric.from_dataset(lay_out(scene))
    return knit, mesh_scene(scene, knit)


def pull(scene):
    """History of a scene."""
    knit, mesh = knit_and_mesh(scene)
    return solve(scene, knit, mesh=mesh)


def pull_apart(folder, threads, name, *options):
    """Pull a scene with a number of threads in a process of its own: file of its history, and the process, ended."""
    history, checkpoint = folder / f"history-{threads}.nc", folder / f"restart-{threads}.npz"
    command = [sys.executable, __file__, name, str(history), str(checkpoint), *options]
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    return history, done


def main(name, history, checkpoint, *options):
    changes = {key: json.loads(value) for key, value in (option.split("=") for option in options)}
    kill = changes.pop("kill", None)
    scene = load_scene(name).vary(changes)

    # The log of the loop, a line an increment.
    logging.basicConfig(stream=sys.stdout, format="%(message)s")
    logging.getLogger("knitstudy.loading.solve").setLevel(logging.INFO)
    done = -1

    def watch(load, place):
        nonlocal done
        done += 1
        if done == kill:
            os.kill(os.getpid(), signal.SIGKILL)

    knit, mesh = knit_and_mesh(scene)
    write_dataset(solve(scene, knit, Run(restart=Path(checkpoint), progress=watch), mesh=mesh), history)


if __name__ == "__main__":
    main(*sys.argv[1:])
