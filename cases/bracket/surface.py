"""Looks at surfaces with trimesh: closed, oriented, one piece, volume. `python3 surface.py FILE...`"""

import sys

import trimesh

for name in sys.argv[1:]:
    loaded = trimesh.load(name)
    mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
    mesh.merge_vertices()
    size = " x ".join(f"{length:.1f}" for length in mesh.extents)
    print(
        f"{name}: {len(mesh.faces)} triangles, closed: {mesh.is_watertight}, oriented: {mesh.is_winding_consistent}, "
        f"pieces: {mesh.body_count}, volume {mesh.volume:.0f}, size {size}, unit {mesh.units}"
    )
