"""What is simulated: the keys of a scene, families of scenes, and what may be asked of them. No mechanics."""
