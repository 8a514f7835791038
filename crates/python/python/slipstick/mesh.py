"""The mesh of a problem as arrays."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _slipstick

if TYPE_CHECKING:
    import meshio
    import pyvista

__all__ = ["Body", "Mesh"]


@dataclass(frozen=True)
class Body:
    """A body: ranges of the elements and the nodes of the mesh.

    Attributes
    ----------
    elements, nodes : slice or ndarray of int
        Indices into arrays over elements, such as densities, and over nodes; slices if the numbers
        are consecutive, as they are in ``problem.mesh``.
    """

    elements: slice | NDArray[np.int64]
    nodes: slice | NDArray[np.int64]


_KINDS = (("hexahedra", 8, "C3D8"), ("wedges", 6, "C3D6"), ("tetrahedra", 4, "C3D4"))

# Names of cell types in meshio and in the reader of mesh files, by argument.
_CELLS = {
    "hexahedra": ("hexahedron", "hex8"),
    "wedges": ("wedge", "wedge6"),
    "tetrahedra": ("tetra", "tet4"),
}
_FACETS = ("triangle", "quad", "triangle3", "quad4")
_SECOND_ORDER = {
    "hexahedron20": "hexahedron",
    "hexahedron27": "hexahedron",
    "hex20": "hexahedron",
    "hex27": "hexahedron",
    "wedge15": "wedge",
    "wedge18": "wedge",
    "tetra10": "tetra",
    "tet10": "tetra",
    "triangle6": "triangle",
    "quad8": "quad",
    "quad9": "quad",
}
_CORNERS = {"hexahedron": 8, "wedge": 6, "tetra": 4, "triangle": 3, "quad": 4}
_SMALL = ("vertex", "line", "line3", "point", "line2")

# name of a part, and numbers of its cells
_Sets = Mapping[str, NDArray[np.int64]]


class Mesh:
    """A mesh of bodies, in its reference configuration. Do not change its arrays.

    Nodes and elements are numbered from 0. Elements of the three types share one numbering, that of
    densities: hexahedra first, then wedges, then tetrahedra, unless their numbers are given.

    ``problem.mesh`` is an example. A mesh that you make can be a body of a case: pass it as the
    ``mesh`` of the body, or as ``{"file": mesh, "part": NAME, "scale": FACTOR}``, where `part` is
    one of its bodies.

    Parameters
    ----------
    nodes : array_like, shape (nodes, 3)
        Coordinates. [L]
    hexahedra, wedges, tetrahedra : array_like of int, shapes (k, 8), (k, 6), (k, 4)
        Nodes of the elements. Hexahedra and tetrahedra are numbered as in VTK, wedges as in Gmsh.
        Elements whose nodes are numbered in inverted order are corrected when a case uses them,
        with a warning.
    bodies : mapping of str to array_like of int, slice or Body
        Numbers of the elements of each body; by default, all elements form one body.
    sets : mapping of str to array_like of int
        Node sets. In a case, a set is called ``{body}_{set}``.
    surfaces : mapping of str to array_like of int, shape (facets, 3) or (facets, 4)
        Corners of facets on the boundary of the bodies, clockwise or counter-clockwise; the fourth
        corner of a triangle is -1. In a case, a surface is called ``{body}_{surface}``.
    hexahedron_numbers, wedge_numbers, tetrahedron_numbers : array_like of int, shape (k,)
        Numbers of the elements.

    Attributes
    ----------
    nodes : ndarray, shape (nodes, 3)
        Coordinates, in units of length.
    hexahedra, wedges, tetrahedra : ndarray of int, shapes (k, 8), (k, 6), (k, 4)
        Nodes of the elements.
    hexahedron_numbers, wedge_numbers, tetrahedron_numbers : ndarray of int, shape (k,)
        Numbers of these elements.
    volumes : ndarray, shape (elements,)
        Volumes of all elements.
    bodies : mapping of str to Body
        The bodies by name, in the order of their elements.
    sets : mapping of str to ndarray of int
        Nodes of every node set and surface, ascending.
    surfaces : mapping of str to ndarray of int, shape (facets, 4)
        Corners of the facets of every surface; the fourth corner of a triangle is -1. Those of
        ``problem.mesh`` are counter-clockwise seen from outside.

    Raises
    ------
    ValueError, TypeError
        If an array has a wrong shape or type, or refers to nodes or elements that do not exist.

    Examples
    --------
    >>> import slipstick as ss
    >>> mesh = ss.Case.template("cube-on-cuboid").build().mesh
    >>> mesh.nodes.shape, mesh.hexahedra.shape, list(mesh.bodies)
    ((28, 3), (5, 8), ['cuboid', 'cube'])
    >>> mesh.sets["cube_ymin"]
    array([20, 21, 24, 25])

    A body from arrays:

    >>> import numpy as np
    >>> nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> corner = ss.Mesh(nodes, tetrahedra=[[0, 1, 2, 3]], surfaces={"floor": [[0, 1, 2]]})
    >>> steel = {"neo_hooke": {"youngs_modulus": 1000.0, "poisson_ratio": 0.3}}
    >>> case = ss.Case.from_dict({
    ...     "body": [{"name": "tip", "mesh": corner, "material": steel}],
    ...     "dirichlet": [{"set": "tip_floor"}],
    ...     "load_path": {"steps": 1},
    ... })
    >>> case.build().mesh.sets["tip_floor"]
    array([0, 1, 2])
    """

    def __init__(
        self,
        nodes: ArrayLike,
        hexahedra: ArrayLike | None = None,
        wedges: ArrayLike | None = None,
        tetrahedra: ArrayLike | None = None,
        *,
        bodies: Mapping[str, ArrayLike | slice | Body] | None = None,
        sets: Mapping[str, ArrayLike] | None = None,
        surfaces: Mapping[str, ArrayLike] | None = None,
        hexahedron_numbers: ArrayLike | None = None,
        wedge_numbers: ArrayLike | None = None,
        tetrahedron_numbers: ArrayLike | None = None,
    ) -> None:
        self.nodes: NDArray[np.float64] = _arrays.real(
            nodes, "nodes", (None, 3), "three coordinates for each node"
        )
        count = len(self.nodes)
        corners = []
        for (name, columns, _), given in zip(_KINDS, (hexahedra, wedges, tetrahedra), strict=True):
            found = _arrays.whole(given, name, columns, count, "nodes")
            twice = np.flatnonzero((np.diff(np.sort(found, axis=1), axis=1) == 0).any(axis=1))
            if len(twice):
                raise ValueError(f"{name}[{twice[0]}] has a node twice: {found[twice[0]].tolist()}")
            corners.append(found)
        self.hexahedra, self.wedges, self.tetrahedra = corners
        self.elements = sum(len(found) for found in corners)
        """Number of elements."""
        if self.elements == 0:
            raise ValueError("there are no elements: give hexahedra, wedges or tetrahedra")
        numbers = []
        first = 0
        for name, given, found in (
            ("hexahedron_numbers", hexahedron_numbers, corners[0]),
            ("wedge_numbers", wedge_numbers, corners[1]),
            ("tetrahedron_numbers", tetrahedron_numbers, corners[2]),
        ):
            if given is None:
                given = np.arange(first, first + len(found))
            numbers.append(_arrays.members(given, name, self.elements, "elements"))
            if len(numbers[-1]) != len(found):
                raise ValueError(f"{name} has {len(numbers[-1])} entries for {len(found)} elements")
            first += len(found)
        self.hexahedron_numbers, self.wedge_numbers, self.tetrahedron_numbers = numbers
        if len(np.unique(np.concatenate(numbers))) != self.elements:
            raise ValueError("element numbers are given twice: each element has its own, from 0")
        self._of_bodies = {
            name: _elements(given, name, self.elements) for name, given in (bodies or {}).items()
        }
        self.sets: dict[str, NDArray[np.int64]] = {
            name: np.unique(_arrays.members(given, f"sets[{name!r}]", count, "nodes"))
            for name, given in (sets or {}).items()
        }
        self.surfaces: dict[str, NDArray[np.int64]] = {
            name: _facets(given, name, count) for name, given in (surfaces or {}).items()
        }
        for name, facets in self.surfaces.items():
            self.sets.setdefault(name, np.unique(facets[facets >= 0]))

    @classmethod
    def _of(cls, problem: _slipstick.Problem) -> Mesh:
        self = cls.__new__(cls)
        self.nodes = _arrays.frozen(problem.nodes())
        self.hexahedra, self.hexahedron_numbers = map(_arrays.frozen, problem.elements(8))
        self.wedges, self.wedge_numbers = map(_arrays.frozen, problem.elements(6))
        self.tetrahedra, self.tetrahedron_numbers = map(_arrays.frozen, problem.elements(4))
        self.elements = problem.element_count
        self._of_bodies = {name: np.arange(*elements) for name, elements, _ in problem.bodies()}
        self.sets = {name: _arrays.frozen(nodes) for name, nodes in problem.sets().items()}
        self.surfaces = {name: _arrays.frozen(of) for name, of in problem.surfaces().items()}
        return self

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """Volumes of all elements, shape (elements,). [L³]"""
        volumes = np.empty(self.elements)
        for corners, numbers in self._blocks():
            volumes[numbers] = _slipstick.volumes(self.nodes, corners)
        return _arrays.frozen(volumes)

    @cached_property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies by name; empty if all elements are one body without a name."""
        found = {}
        for name, elements in self._of_bodies.items():
            nodes = [
                corners[np.isin(numbers, elements)].ravel() for corners, numbers in self._blocks()
            ]
            found[name] = Body(_range(elements), _range(np.unique(np.concatenate(nodes))))
        return found

    def _blocks(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        return [
            (self.hexahedra, self.hexahedron_numbers),
            (self.wedges, self.wedge_numbers),
            (self.tetrahedra, self.tetrahedron_numbers),
        ]

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, first_order: bool = False) -> Mesh:
        """Read a mesh file with the reader of case files: Gmsh, Abaqus or VTU.

        Parameters
        ----------
        path : path-like
            A ``.msh``, ``.inp`` or ``.vtu`` file.
        first_order : bool
            Whether to drop the mid-side nodes of second-order elements.

        Returns
        -------
        Mesh
            Its bodies are the named sets of solid elements, its surfaces those of facets, and its
            node sets those of lines, points and nodes.

        Raises
        ------
        OSError
            If the file cannot be read.
        InputError
            If it is not a supported mesh file.
        ValueError
            If it contains unsupported elements.
        """
        points, blocks, cell_sets, node_sets, faces, _ = _slipstick.read_mesh(FilePath(path))
        return _assembled(points, blocks, cell_sets, node_sets, faces, first_order, os.fspath(path))

    @classmethod
    def from_meshio(cls, mesh: meshio.Mesh, *, first_order: bool = False) -> Mesh:
        """Make a mesh from a meshio mesh.

        Parameters
        ----------
        mesh : meshio.Mesh
            Cell sets, and physical groups of Gmsh, become bodies if they have hexahedra, wedges or
            tetrahedra, surfaces if they have triangles or quadrilaterals, and otherwise node sets;
            point sets become node sets.
        first_order : bool
            Whether to drop the mid-side nodes of second-order elements.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            If it contains unsupported elements.
        """
        blocks = []
        first = 0
        for block in mesh.cells:
            cells = np.asarray(block.data, dtype=np.int64)
            blocks.append((str(block.type), cells, np.arange(first, first + len(cells))))
            first += len(cells)
        sets: dict[str, list[NDArray[np.int64]]] = {}
        for name, parts in mesh.cell_sets.items():
            if name.startswith("gmsh:"):
                continue
            for (_, _, numbers), part in zip(blocks, parts, strict=True):
                if part is not None and len(part):
                    sets.setdefault(name, []).append(numbers[np.asarray(part, dtype=np.int64)])
        groups = mesh.cell_data.get("gmsh:physical", [])
        for name, (tag, dimension) in mesh.field_data.items():
            for (kind, _, numbers), tags in zip(blocks, groups, strict=False):
                chosen = numbers[np.asarray(tags) == tag]
                if name not in mesh.cell_sets and len(chosen) and _dimension(kind) == dimension:
                    sets.setdefault(name, []).append(chosen)
        points = np.asarray(mesh.points, dtype=np.float64)
        cell_sets = {name: np.concatenate(parts) for name, parts in sets.items()}
        node_sets = {name: np.asarray(nodes) for name, nodes in mesh.point_sets.items()}
        return _assembled(points, blocks, cell_sets, node_sets, {}, first_order, "mesh")

    @classmethod
    def from_pyvista(
        cls,
        grid: pyvista.UnstructuredGrid,
        *,
        bodies: str | None = None,
        surfaces: Mapping[str, ArrayLike] | None = None,
        sets: Mapping[str, ArrayLike] | None = None,
        first_order: bool = False,
    ) -> Mesh:
        """Make a mesh from an unstructured PyVista grid.

        Parameters
        ----------
        grid : pyvista.UnstructuredGrid
            Hexahedra, voxels, wedges and tetrahedra. Other cells are ignored, but unsupported solid
            cells are an error. Convert other kinds of grids with ``cast_to_unstructured_grid``.
        bodies : str, optional
            Name of a cell array: cells with equal values form a body, named after the value. By
            default, all cells form one body.
        surfaces : mapping of str to array_like of int, shape (facets, 3) or (facets, 4), optional
            As for :class:`Mesh`.
        sets : mapping of str to array_like of int, optional
            As for :class:`Mesh`.
        first_order : bool
            Whether to drop the mid-side nodes of second-order elements.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            As for :meth:`from_meshio`.
        """
        if not hasattr(grid, "cells_dict"):
            raise TypeError(
                f"grid is of type {type(grid).__name__}: give an UnstructuredGrid, for instance "
                "grid.cast_to_unstructured_grid()"
            )
        import pyvista

        older = pyvista.vtk_version_info < (9, 7)
        cell_types = np.asarray(grid.celltypes)
        blocks = []
        for kind, cells in grid.cells_dict.items():
            corners = np.asarray(cells, dtype=np.int64)
            name = _VTK.get(int(kind), f"VTK cell type {int(kind)}")
            if name == "voxel":
                corners, name = corners[:, [0, 1, 3, 2, 4, 5, 7, 6]], "hexahedron"
            if name == "wedge" and older:
                corners = corners[:, [0, 2, 1, 3, 5, 4]]
            blocks.append((name, corners, np.flatnonzero(cell_types == kind)))
        cell_sets = {}
        if bodies is not None:
            if bodies not in grid.cell_data:
                known = ", ".join(grid.cell_data.keys()) or "none"
                raise ValueError(f"bodies is {bodies!r}, but the cell arrays are: {known}")
            values = np.asarray(grid.cell_data[bodies])
            cell_sets = {str(value): np.flatnonzero(values == value) for value in np.unique(values)}
        count = grid.n_points
        return _assembled(
            np.asarray(grid.points, dtype=np.float64),
            blocks,
            cell_sets,
            {
                name: _arrays.members(given, f"sets[{name!r}]", count, "points")
                for name, given in (sets or {}).items()
            },
            {name: _facets(given, name, count) for name, given in (surfaces or {}).items()},
            first_order,
            "grid",
        )

    def _as_file(self) -> tuple[str, bytes]:
        """A name, and the mesh as the text of an Abaqus file with numbers from 0."""
        lines = ["*NODE"]
        lines += [f"{n},{x!r},{y!r},{z!r}" for n, (x, y, z) in enumerate(self.nodes.tolist())]
        rows: list[tuple[str, list[int]]] = [("", [])] * self.elements
        for (_, _, kind), (corners, numbers) in zip(_KINDS, self._blocks(), strict=True):
            for number, row in zip(numbers.tolist(), corners.tolist(), strict=True):
                rows[number] = (kind, row)
        # elements keep the order of their numbers
        last = ""
        for number, (kind, row) in enumerate(rows):
            if kind != last:
                lines.append(f"*ELEMENT, TYPE={kind}")
                last = kind
            lines.append(f"{number}," + ",".join(map(str, row)))
        for name, elements in self._of_bodies.items():
            if name in self.surfaces:
                raise ValueError(f"a body and a surface are both called {name!r}: rename one")
            lines.append(f"*ELSET, ELSET={_set_name(name, 'bodies')}")
            lines += map(str, elements.tolist())
        number = self.elements
        for name, facets in self.surfaces.items():
            for kind, chosen in (
                ("S3", facets[facets[:, 3] < 0][:, :3]),
                ("S4", facets[facets[:, 3] >= 0]),
            ):
                if len(chosen):
                    lines.append(f"*ELEMENT, TYPE={kind}, ELSET={_set_name(name, 'surfaces')}")
                    for row in chosen.tolist():
                        lines.append(f"{number}," + ",".join(map(str, row)))
                        number += 1
        for name, nodes in self.sets.items():
            if name not in self.surfaces:
                lines.append(f"*NSET, NSET={_set_name(name, 'sets')}")
                lines += map(str, nodes.tolist())
        data = ("\n".join(lines) + "\n").encode()
        return f"mesh_{hashlib.sha256(data).hexdigest()[:16]}.inp", data

    def __repr__(self) -> str:
        bodies = ", ".join(self._of_bodies)
        what = f", bodies {bodies}" if bodies else ""
        return f"<Mesh: {len(self.nodes)} nodes, {self.elements} elements{what}>"

    def to_pyvista(
        self,
        cell_data: Mapping[str, Any] | None = None,
        point_data: Mapping[str, Any] | None = None,
        displacement: NDArray[np.float64] | None = None,
    ) -> pyvista.UnstructuredGrid:
        """The mesh as a PyVista grid, with the elements in the order of their numbers.

        Parameters
        ----------
        cell_data, point_data : mapping of str to array, optional
            Arrays over elements, such as densities, and over nodes.
        displacement : ndarray, shape (nodes, 3), optional
            Displacements to add to the coordinates.

        Returns
        -------
        pyvista.UnstructuredGrid
        """
        import pyvista

        cells: list[NDArray[np.int64] | None] = [None] * self.elements
        types = np.zeros(self.elements, dtype=np.uint8)
        # before version 9.7, VTK numbers wedges in the opposite sense
        older = pyvista.vtk_version_info < (9, 7)
        wedges = self.wedges[:, [0, 2, 1, 3, 5, 4]] if older else self.wedges
        for kind, corners, numbers in (
            (pyvista.CellType.HEXAHEDRON, self.hexahedra, self.hexahedron_numbers),
            (pyvista.CellType.WEDGE, wedges, self.wedge_numbers),
            (pyvista.CellType.TETRA, self.tetrahedra, self.tetrahedron_numbers),
        ):
            types[numbers] = kind
            for number, nodes in zip(numbers, corners, strict=True):
                cells[number] = nodes
        flat = np.concatenate([np.concatenate(([len(c)], c)) for c in cells if c is not None])
        points = self.nodes if displacement is None else self.nodes + displacement
        grid = pyvista.UnstructuredGrid(flat, types, points)
        grid.cell_data.update(cell_data or {})
        grid.point_data.update(point_data or {})
        return grid

    def to_meshio(self, cell_data: Mapping[str, Any] | None = None) -> meshio.Mesh:
        """The mesh as a meshio mesh, with the node sets and a block for each element type.

        Parameters
        ----------
        cell_data : mapping of str to array, optional
            Arrays over elements, such as densities.

        Returns
        -------
        meshio.Mesh
        """
        import meshio

        kinds = [
            ("hexahedron", self.hexahedra, self.hexahedron_numbers),
            ("wedge", self.wedges, self.wedge_numbers),
            ("tetra", self.tetrahedra, self.tetrahedron_numbers),
        ]
        kinds = [kind for kind in kinds if len(kind[1])]
        data = {
            name: [np.asarray(values)[numbers] for _, _, numbers in kinds]
            for name, values in (cell_data or {}).items()
        }
        cells = [(name, corners) for name, corners, _ in kinds]
        return meshio.Mesh(self.nodes, cells, cell_data=data, point_sets=dict(self.sets))


_VTK = {
    1: "vertex",
    3: "line",
    5: "triangle",
    9: "quad",
    10: "tetra",
    11: "voxel",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    21: "line3",
    22: "triangle6",
    23: "quad8",
    24: "tetra10",
    25: "hexahedron20",
    26: "wedge15",
    27: "pyramid13",
    28: "quad9",
    29: "hexahedron27",
    32: "wedge18",
}


def _dimension(kind: str) -> int:
    kind = _SECOND_ORDER.get(kind, kind)
    return 1 if kind in _SMALL else 2 if kind in _FACETS or kind == "quad" else 3


def _assembled(
    points: NDArray[np.float64],
    blocks: Sequence[tuple[str, NDArray[np.int64], NDArray[np.int64]]],
    cell_sets: _Sets,
    node_sets: _Sets,
    faces: _Sets,
    first_order: bool,
    source: str,
) -> Mesh:
    """A mesh from blocks of cells: their type, their nodes, their positions among all cells."""
    solids: dict[str, list[tuple[NDArray[np.int64], NDArray[np.int64]]]] = {}
    facets: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    small: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for name, cells, positions in blocks:
        kind = name
        if kind in _SECOND_ORDER:
            if not first_order:
                raise ValueError(
                    f"{source} has {len(cells)} second-order elements ({kind}): "
                    "give first_order=True, which drops their mid-side nodes"
                )
            kind = _SECOND_ORDER[kind]
            cells = cells[:, : _CORNERS[kind]]
        if kind in _FACETS:
            padded = np.full((len(cells), 4), -1, dtype=np.int64)
            padded[:, : cells.shape[1]] = cells
            facets.append((padded, positions))
            continue
        if kind in _SMALL:
            small.append((cells, positions))
            continue
        argument = next((key for key, names in _CELLS.items() if kind in names), None)
        if argument is None:
            raise ValueError(
                f"{source} has {len(cells)} cells of type {kind}, which are not supported: "
                "mesh with hexahedra, wedges or tetrahedra, or remove them"
            )
        solids.setdefault(argument, []).append((cells, positions))
    if not solids:
        raise ValueError(f"{source} has no hexahedra, wedges or tetrahedra")
    arrays: dict[str, NDArray[np.int64]] = {}
    # number of each cell among the elements
    total = sum(len(positions) for _, _, positions in blocks)
    elements = np.full(total, -1, dtype=np.int64)
    first = 0
    for argument, _, _ in _KINDS:
        parts = solids.get(argument, [])
        if not parts:
            continue
        arrays[argument] = np.concatenate([cells for cells, _ in parts])
        positions = np.concatenate([positions for _, positions in parts])
        elements[positions] = np.arange(first, first + len(positions))
        first += len(positions)
    facet_of = np.full(total, -1, dtype=np.int64)
    rows = np.concatenate([cells for cells, _ in facets]) if facets else np.zeros((0, 4), np.int64)
    if facets:
        positions = np.concatenate([positions for _, positions in facets])
        facet_of[positions] = np.arange(len(positions))
    bodies, surfaces, sets = {}, dict(faces), dict(node_sets)
    for name, cells in cell_sets.items():
        of_elements, of_facets = elements[cells], facet_of[cells]
        if (of_elements >= 0).any():
            bodies[name] = of_elements[of_elements >= 0]
        elif (of_facets >= 0).any():
            surfaces[name] = rows[of_facets[of_facets >= 0]]
        elif name not in sets:
            # points and lines
            nodes = [of[np.isin(positions, cells)].ravel() for of, positions in small]
            sets[name] = np.unique(np.concatenate([np.zeros(0, np.int64), *nodes]))
    # keep only nodes that elements use: mid-side nodes and points of geometry belong to none
    used = np.zeros(len(points), dtype=bool)
    for cells in arrays.values():
        used[cells] = True
    number = np.full(len(points) + 1, -1, dtype=np.int64)
    number[:-1][used] = np.arange(int(used.sum()))
    surfaces = {
        name: kept[(kept[:, :3] >= 0).all(axis=1)]
        for name, kept in ((name, number[facets]) for name, facets in surfaces.items())
    }
    sets = {name: number[nodes][used[nodes]] for name, nodes in sets.items()}
    return Mesh(
        points[used],
        **{argument: number[cells] for argument, cells in arrays.items()},
        bodies=bodies,
        sets={name: nodes for name, nodes in sets.items() if len(nodes)},
        surfaces={name: facets for name, facets in surfaces.items() if len(facets)},
    )


def _elements(given: ArrayLike | slice | Body, name: str, count: int) -> NDArray[np.int64]:
    if isinstance(given, Body):
        given = given.elements
    if isinstance(given, slice):
        given = np.arange(*given.indices(count))
    found = np.unique(_arrays.members(given, f"bodies[{name!r}]", count, "elements"))
    if len(found) == 0:
        raise ValueError(f"bodies[{name!r}] is empty: give the numbers of its elements")
    return found


def _facets(given: ArrayLike, name: str, count: int) -> NDArray[np.int64]:
    place = f"surfaces[{name!r}]"
    array = _arrays.rectangular(given, place)
    columns = array.shape[1] if array.ndim == 2 and array.shape[1] in (3, 4) else 4
    found = _arrays.whole(given, place, columns, count, "nodes", filler=columns == 4)
    if columns == 4:
        return found
    padded = np.full((len(found), 4), -1, dtype=np.int64)
    padded[:, :3] = found
    return padded


def _range(numbers: NDArray[np.int64]) -> slice | NDArray[np.int64]:
    """A slice where the numbers, which ascend, are consecutive."""
    if len(numbers) and int(numbers[-1]) - int(numbers[0]) + 1 == len(numbers):
        return slice(int(numbers[0]), int(numbers[-1]) + 1)
    return numbers


def _set_name(name: str, argument: str) -> str:
    if not isinstance(name, str) or not name.strip() or any(c in name for c in ',"\n\r='):
        raise ValueError(
            f"{argument} has the name {name!r}: names are strings without commas, quotes and '='"
        )
    return f'"{name}"'
