"""Draws a surface with PyVista: `python3 picture.py SURFACE PICTURE`."""

import sys

import pyvista

mesh = pyvista.read(sys.argv[1])
plotter = pyvista.Plotter(off_screen=True, window_size=(1200, 900))
plotter.set_background("white")
plotter.add_mesh(mesh, color="#c9ced6", smooth_shading=True, split_sharp_edges=True, specular=0.2)
plotter.view_vector((1.0, 0.55, 1.6), viewup=(0, 1, 0))
plotter.camera.zoom(1.2)
plotter.screenshot(sys.argv[2])
