"""From a scene to the history of a knit: keys, geometry, mesh, loading, models, contacts, stresses."""
