"""Compares the VTKHDF file of a run with its VTU files: mesh and every array of every step, bit for
bit.

    pip install pyvista h5py
    slipstick solve CASE --set output.vtkhdf=true --out RESULTS   # built with the feature `vtkhdf`
    python vtkhdf.py RESULTS

Two readers that do not know each other open the file: VTK's (that of ParaView and PyVista) and, if
it is installed, h5py, in its own process because both bring an HDF5 library. Ends with an error
where something differs.
"""

import pathlib
import subprocess
import sys

import numpy

results = pathlib.Path(sys.argv[1])


def same(found, expected, what):
    """The same type, shape and bits."""
    a, b = numpy.asarray(found), numpy.asarray(expected)
    assert a.dtype == b.dtype and a.shape == b.shape, (what, a.dtype, a.shape, b.dtype, b.shape)
    assert a.tobytes() == b.tobytes(), f"{what} differs"


def with_vtk():
    import pyvista
    import vtk

    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(results / "path.vtkhdf"))
    reader.UpdateInformation()
    series = pyvista.get_reader(results / "path.pvd")
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = list(reader.GetOutputInformation(0).Get(key))
    same(times, series.time_values, "times")
    compared = 0
    for time in times:
        reader.UpdateTimeStep(time)
        found = pyvista.wrap(reader.GetOutputDataObject(0))
        series.set_active_time_value(time)
        expected = series.read()[0]
        for name in ("points", "cells", "celltypes"):
            same(getattr(found, name), getattr(expected, name), f"{name} at {time}")
        for place in ("point_data", "cell_data"):
            a, b = getattr(found, place), getattr(expected, place)
            assert set(a.keys()) == set(b.keys()), (place, a.keys(), b.keys())  # VTK moves active ones to the end
            assert (a.active_scalars_name, a.active_vectors_name) == (b.active_scalars_name, b.active_vectors_name)
            for name in a.keys():
                same(a[name], b[name], f"{place} {name} at {time}")
                compared += 1
    print(f"VTK {vtk.vtkVersion().GetVTKVersion()}: {compared} arrays of {len(times)} steps are those of the VTU files")


def with_h5py():
    try:
        import h5py
    except ImportError:
        print("h5py is not installed; only VTK was used")
        return
    import re
    import xml.etree.ElementTree as xml

    def vtu(path):
        """The arrays of a file of slipstick by section and name; VTK is not needed for it."""
        data = path.read_bytes()
        mark = b'<AppendedData encoding="raw">\n_'
        start = data.index(mark) + len(mark)
        text = re.sub(rb"<AppendedData.*", b"</VTKFile>", data[: start], flags=re.DOTALL)
        types = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}
        arrays = {}
        for section in xml.fromstring(text).find("UnstructuredGrid/Piece"):
            for array in section:
                offset = start + int(array.get("offset"))
                size = int(numpy.frombuffer(data, "<u8", 1, offset)[0])
                values = numpy.frombuffer(data[offset + 8 : offset + 8 + size], types[array.get("type")])
                components = int(array.get("NumberOfComponents", 1))
                shape = (-1, components) if components > 1 else (-1,)
                arrays[section.tag, array.get("Name")] = values.reshape(shape)
        return arrays

    files = [entry.get("file") for entry in xml.parse(results / "path.pvd").iter("DataSet")]
    files = [pathlib.Path(name).with_suffix(".vtu") for name in files]
    times = [float(entry.get("timestep")) for entry in xml.parse(results / "path.pvd").iter("DataSet")]
    with h5py.File(results / "path.vtkhdf") as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        assert root.attrs["Type"] == b"UnstructuredGrid" and list(root.attrs["Version"]) == [2, 6]
        assert steps.attrs["NSteps"] == len(files)
        same(steps["Values"][:], times, "times")
        for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
            assert len(steps[name]) == len(files) and not steps[name][:].any(), f"{name}: the mesh is written once"
        compared = 0
        for step, name in enumerate(files):
            expected = vtu(results / name)
            same(root["Points"][:], expected["Points", "Points"], "points")
            same(root["Connectivity"][:], expected["Cells", "connectivity"], "connectivity")
            same(root["Offsets"][1:], expected["Cells", "offsets"], "offsets")
            same(root["Types"][:], expected["Cells", "types"], "types")
            counts = {"PointData": root["NumberOfPoints"][0], "CellData": root["NumberOfCells"][0]}
            for place, count in counts.items():
                names = {name for section, name in expected if section == place}
                assert set(root[place]) == names, (place, set(root[place]) ^ names)
                for name in names:
                    start = steps[f"{place}Offsets/{name}"][step]
                    same(root[place][name][start : start + count], expected[place, name], f"{name} at step {step}")
                    compared += 1
    versions = f"h5py {h5py.version.version} with HDF5 {h5py.version.hdf5_version}"
    print(f"{versions}: {compared} arrays of {len(files)} steps are those of the VTU files")


if sys.argv[2:] == ["h5py"]:
    with_h5py()
else:
    with_vtk()
    sys.stdout.flush()
    subprocess.run([sys.executable, __file__, str(results), "h5py"], check=True)
    sizes = [sum(path.stat().st_size for path in results.glob(name)) for name in ("path.vtkhdf", "path_*.vtu")]
    print(f"path.vtkhdf {sizes[0]} bytes, VTU files {sizes[1]} bytes")
