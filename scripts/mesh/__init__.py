"""Makes the cell's meshes: surfaces from outlines, assembled to machines, written as Collada."""
