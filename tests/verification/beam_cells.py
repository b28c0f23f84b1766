"""Keys of endless cells of beams that are pulled a little: elastic yarn, friction, no ties."""

BEAMS = {
    "fidelity": "beam",
    "interaction": "isotropic",
    "contact.tied_edges": "none",
    "load.lateral": "fixed",
    "mesh.beam_size": 0.41,
    "beam.section": "hertz",
    "load.strain": 0.02,
    "solver.increments": 2,
}
