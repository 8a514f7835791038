"""Opens the PVD and VTU series of a run with PyVista and compares them with the run's tables.

    python series.py RESULTS

RESULTS is the directory of an optimization. Ends with an error where something is missing or differs.
"""

import csv
import pathlib
import sys

import numpy
import pyvista

results = pathlib.Path(sys.argv[1])


def table(name):
    with open(results / name, newline="") as file:
        return list(csv.DictReader(file))


def series(name):
    reader = pyvista.get_reader(results / name)
    for time in reader.time_values:
        reader.set_active_time_value(time)
        block = reader.read()
        yield time, block[0] if isinstance(block, pyvista.MultiBlock) else block


# the designs: one per stored iteration, the last with the densities of design.csv to the last bit
designs = list(series("design.pvd"))
history = {int(row["iteration"]): row for row in table("history.csv")}
assert all(int(time) in history for time, _ in designs), [time for time, _ in designs]
final = designs[-1][1]
density = numpy.array([float(row["density"]) for row in table("design.csv")])
assert final.n_cells == len(density), (final.n_cells, len(density))
assert numpy.array_equal(final.cell_data["density"], density), "densities"
volumes = final.compute_cell_sizes(length=False, area=False)["Volume"]
assert volumes.min() > 0, "an element is inside out"

# the load path: a file per state, pseudo-time from 0 to 1, displacements that begin at rest
path = list(series("path.pvd"))
times = [time for time, _ in path]
assert times == sorted(times) and times[0] == 0 and times[-1] == 1, times
for time, grid in path:
    assert grid.n_cells == len(density)
    displacement = grid.point_data["displacement"]
    assert displacement.shape == (grid.n_points, 3) and numpy.isfinite(displacement).all()
assert not path[0][1].point_data["displacement"].any()

# at the end: open, sticking and slipping slave nodes as history.csv counts them
end = path[-1][1]
row = history[max(history)]
status = end.point_data["contact_status"]
counted = [int((status == value).sum()) for value in (0, 1, 2)]
expected = [int(row[name]) for name in ("open", "stick", "slip")]
assert counted[1:] == expected[1:], (counted, expected)
print(f"{len(designs)} designs, {len(path)} states, fields {sorted(end.point_data.keys())} and {sorted(end.cell_data.keys())}")
