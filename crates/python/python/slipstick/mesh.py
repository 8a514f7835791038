"""The mesh of a problem as arrays."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, NamedTuple

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


class _Kind(NamedTuple):
    """Elements of one type and order."""

    argument: str
    corners: int
    nodes: int
    abaqus: str
    meshio: str
    vtk: int


_KINDS = (
    _Kind("hexahedra", 8, 8, "C3D8", "hexahedron", 12),
    _Kind("hexahedra", 8, 27, "C3D27", "hexahedron27", 29),
    _Kind("wedges", 6, 6, "C3D6", "wedge", 13),
    _Kind("wedges", 6, 18, "C3D15V", "wedge18", 32),
    _Kind("tetrahedra", 4, 4, "C3D4", "tetra", 10),
    _Kind("tetrahedra", 4, 10, "C3D10", "tetra10", 24),
)
# Number of corners and possible numbers of nodes, by argument.
_SHAPES = {"hexahedra": (8, (8, 27)), "wedges": (6, (6, 18)), "tetrahedra": (4, (4, 10))}

# Nodes of the faces of second-order elements, counter-clockwise seen from outside: corners, the
# nodes on the edges from each corner to the next, and the one at the centre. Triangles and
# quadrilaterals are separate arrays.
_FACES_OF = {
    27: (
        np.array(
            [
                [0, 3, 2, 1, 11, 10, 9, 8, 24],
                [4, 5, 6, 7, 12, 13, 14, 15, 25],
                [0, 1, 5, 4, 8, 17, 12, 16, 22],
                [1, 2, 6, 5, 9, 18, 13, 17, 21],
                [2, 3, 7, 6, 10, 19, 14, 18, 23],
                [3, 0, 4, 7, 11, 16, 15, 19, 20],
            ]
        ),
    ),
    18: (
        np.array([[0, 2, 1, 8, 7, 6], [3, 4, 5, 9, 10, 11]]),
        np.array(
            [
                [0, 1, 4, 3, 6, 13, 9, 12, 15],
                [1, 2, 5, 4, 7, 14, 10, 13, 16],
                [2, 0, 3, 5, 8, 12, 11, 14, 17],
            ]
        ),
    ),
    10: (
        np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [2, 0, 3, 6, 7, 9]]),
    ),
}
# Numbers of nodes of second-order elements with all nodes, by argument, and of those that lack the
# nodes at centres.
_COMPLETE = {"hexahedra": (27, 20), "wedges": (18, 15)}
# Abaqus puts the centre of C3D27 before those of its faces, which have another order.
_C3D27 = [*range(20), 26, 24, 25, 22, 21, 23, 20]
# Abaqus reads at most 16 numbers on a line.
_LINE = 16

# Argument and number of nodes of cells, by their names in meshio and in the reader of mesh files.
_CELLS = {
    "hexahedron": ("hexahedra", 8),
    "hex8": ("hexahedra", 8),
    "hexahedron20": ("hexahedra", 20),
    "hex20": ("hexahedra", 20),
    "hexahedron27": ("hexahedra", 27),
    "hex27": ("hexahedra", 27),
    "wedge": ("wedges", 6),
    "wedge6": ("wedges", 6),
    "wedge15": ("wedges", 15),
    "wedge18": ("wedges", 18),
    "tetra": ("tetrahedra", 4),
    "tet4": ("tetrahedra", 4),
    "tetra10": ("tetrahedra", 10),
    "tet10": ("tetrahedra", 10),
}
# Numbers of corners of facets.
_FACETS = {
    "triangle": 3,
    "triangle3": 3,
    "triangle6": 3,
    "quad": 4,
    "quad4": 4,
    "quad8": 4,
    "quad9": 4,
}
_SMALL = ("vertex", "line", "line3", "point", "line2")

# name of a part, and numbers of its cells
_Sets = Mapping[str, NDArray[np.int64]]


class Mesh:
    """A mesh of bodies, in its reference configuration. Do not change its arrays.

    Nodes and elements are numbered from 0. Elements of the three types share one numbering, that of
    densities: hexahedra first, then wedges, then tetrahedra, unless their numbers are given.

    A mesh can be the ``mesh`` of a body in a case, also as ``{"file": mesh, "part": NAME, "scale":
    FACTOR}``, where `part` is one of its bodies. Elements with inverted node numbering are then
    corrected, with a warning.

    The nodes of a second-order element are its corners, then nodes on its edges, then at the
    centres of its quadrilaterals; a hexahedron also has one at its own. All elements of a body have
    the same order. In an array with elements of both orders, linear ones have -1 for the nodes that
    they lack.

    Arguments are attributes, too. There, `surfaces` have four columns, in ``problem.mesh``
    counter-clockwise seen from outside, and `sets` contain the nodes of surfaces.

    Parameters
    ----------
    nodes : array_like, shape (nodes, 3)
        Coordinates. [L]
    hexahedra : array_like of int, shape (k, 8) or (k, 27)
        Nodes of linear or second-order hexahedra, numbered as in VTK (hexahedron, triquadratic
        hexahedron).
    wedges : array_like of int, shape (k, 6) or (k, 18)
        Nodes of linear or second-order wedges; linear ones numbered as in Gmsh, the others as in
        VTK (biquadratic quadratic wedge).
    tetrahedra : array_like of int, shape (k, 4) or (k, 10)
        Nodes of linear or second-order tetrahedra, numbered as in VTK (tetra, quadratic tetra).
    bodies : mapping of str to array_like of int, slice or Body
        Numbers of the elements of each body; by default, all elements form one body.
    sets : mapping of str to array_like of int
        Node sets, with the mid-side nodes that belong to them. In a case, a set is called
        ``{body}_{set}``.
    surfaces : mapping of str to array_like of int, shape (facets, 3) or (facets, 4)
        Corners of facets on the boundary of the bodies, clockwise or counter-clockwise; the fourth
        corner of a triangle is -1. Mid-side nodes belong to a facet without being given. In a
        case, a surface is called ``{body}_{surface}``.
    hexahedron_numbers, wedge_numbers, tetrahedron_numbers : array_like of int, shape (k,)
        Numbers of the elements.

    Attributes
    ----------
    volumes : ndarray, shape (elements,)
        Volumes of all elements, exact for curved ones too. [L³]

    Raises
    ------
    ValueError, TypeError
        If an array has a wrong shape or type, or refers to nodes or elements that do not exist; or
        if elements of a body are of different orders.

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
        cells = []
        for name, given in zip(_SHAPES, (hexahedra, wedges, tetrahedra), strict=True):
            cells.append(_cells(given, name, count))
        self.hexahedra, self.wedges, self.tetrahedra = cells
        self.elements = sum(len(found) for found in cells)
        """Number of elements."""
        if self.elements == 0:
            raise ValueError("there are no elements: give hexahedra, wedges or tetrahedra")
        numbers = []
        first = 0
        for name, given, found in (
            ("hexahedron_numbers", hexahedron_numbers, cells[0]),
            ("wedge_numbers", wedge_numbers, cells[1]),
            ("tetrahedron_numbers", tetrahedron_numbers, cells[2]),
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
        self._refuse_mixed_orders()
        self.sets: dict[str, NDArray[np.int64]] = {
            name: np.unique(_arrays.members(given, f"sets[{name!r}]", count, "nodes"))
            for name, given in (sets or {}).items()
        }
        self.surfaces: dict[str, NDArray[np.int64]] = {
            name: _facets(given, name, count) for name, given in (surfaces or {}).items()
        }
        for name, faces in self._faces().items():
            self.sets.setdefault(name, np.unique(faces[faces >= 0]))

    @classmethod
    def _of(cls, problem: _slipstick.Problem) -> Mesh:
        self = cls.__new__(cls)
        self.nodes = _arrays.frozen(problem.nodes())
        self.hexahedra, self.hexahedron_numbers = _both_orders(
            problem.elements(8), problem.elements(27)
        )
        self.wedges, self.wedge_numbers = _both_orders(problem.elements(6), problem.elements(18))
        self.tetrahedra, self.tetrahedron_numbers = _both_orders(
            problem.elements(4), problem.elements(10)
        )
        self.elements = problem.element_count
        self._of_bodies = {name: np.arange(*elements) for name, elements, _ in problem.bodies()}
        self.sets = {name: _arrays.frozen(nodes) for name, nodes in problem.sets().items()}
        self.surfaces = {name: _arrays.frozen(of) for name, of in problem.surfaces().items()}
        return self

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """Volumes of all elements, shape (elements,). [L³]"""
        volumes = np.empty(self.elements)
        for _, cells, numbers in self._blocks():
            volumes[numbers] = _slipstick.volumes(self.nodes, cells)
        return _arrays.frozen(volumes)

    @cached_property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies by name; empty if all elements are one body without a name."""
        found = {}
        for name, elements in self._of_bodies.items():
            nodes = [
                cells[np.isin(numbers, elements)].ravel() for _, cells, numbers in self._blocks()
            ]
            found[name] = Body(_range(elements), _range(np.unique(np.concatenate(nodes))))
        return found

    def _blocks(self) -> list[tuple[_Kind, NDArray[np.int64], NDArray[np.int64]]]:
        """Kind, nodes and numbers of the elements of each kind that the mesh has."""
        given = {
            "hexahedra": (self.hexahedra, self.hexahedron_numbers),
            "wedges": (self.wedges, self.wedge_numbers),
            "tetrahedra": (self.tetrahedra, self.tetrahedron_numbers),
        }
        blocks = []
        for kind in _KINDS:
            cells, numbers = given[kind.argument]
            if cells.shape[1] > kind.corners:
                chosen = (cells[:, -1] >= 0) == (kind.nodes > kind.corners)
                cells, numbers = cells[chosen, : kind.nodes], numbers[chosen]
            if len(cells) and cells.shape[1] == kind.nodes:
                blocks.append((kind, cells, numbers))
        return blocks

    def _refuse_mixed_orders(self) -> None:
        """Refuse a mesh without any body whose elements are all of the same order."""
        second = np.zeros(self.elements, dtype=bool)
        for kind, _, numbers in self._blocks():
            second[numbers] = kind.nodes > kind.corners
        mixed = []
        for name, elements in (self._of_bodies or {"": np.arange(self.elements)}).items():
            if second[elements].all() or not second[elements].any():
                return
            mixed.append((f"bodies[{name!r}]" if name else "the mesh", elements))
        name, elements = mixed[0]
        quadratic = int(second[elements].sum())
        raise ValueError(
            f"{name} has {len(elements) - quadratic} linear and {quadratic} second-order elements: "
            "mesh each body with elements of one order, or drop mid-side nodes with "
            "first_order=True where the mesh is read"
        )

    def _faces(self) -> dict[str, NDArray[np.int64]]:
        """All nodes of the facets of every surface, shape (facets, 9), with -1 after the last one.
        Facets that are faces of second-order elements have 6 or 9 nodes."""
        found = {}
        for name, facets in self.surfaces.items():
            found[name] = np.full((len(facets), 9), -1, dtype=np.int64)
            found[name][:, :4] = facets
        corners = [facets[facets >= 0] for facets in self.surfaces.values()]
        near = np.zeros(len(self.nodes), dtype=bool)
        near[np.concatenate([np.zeros(0, np.int64), *corners])] = True
        faces: dict[tuple[int, ...], list[int]] = {}
        for kind, cells, _ in self._blocks():
            if kind.nodes == kind.corners:
                continue
            for of_cells in _FACES_OF[kind.nodes]:
                count = 3 if of_cells.shape[1] == 6 else 4
                rows = cells[:, of_cells][near[cells[:, of_cells[:, :count]]].all(axis=2)]
                faces.update((tuple(sorted(row[:count])), row) for row in rows.tolist())
        if faces:
            for name, facets in self.surfaces.items():
                for facet, row in enumerate(facets.tolist()):
                    face = faces.get(tuple(sorted(row if row[3] >= 0 else row[:3])))
                    if face is not None:
                        found[name][facet, : len(face)] = face
        return found

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, first_order: bool = False) -> Mesh:
        """Read a mesh file with the reader of case files: Gmsh, Abaqus or VTU.

        Parameters
        ----------
        path : path-like
            A ``.msh``, ``.inp`` or ``.vtu`` file.
        first_order : bool
            Whether to drop the mid-side nodes of second-order elements. Otherwise, hexahedra of 20
            nodes and wedges of 15 get the nodes that they lack.

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
            If it contains unsupported elements, or elements of both orders in each body.
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
            As for :meth:`read`.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            If it contains unsupported elements, or elements of both orders in each body.
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
            Hexahedra, voxels, wedges and tetrahedra of first or second order. Other cells are
            ignored, but unsupported solid cells are an error. Convert other kinds of grids with
            ``cast_to_unstructured_grid``.
        bodies : str, optional
            Name of a cell array: cells with equal values form a body, named after the value. By
            default, all cells form one body.
        surfaces : mapping of str to array_like of int, shape (facets, 3) or (facets, 4), optional
            As for :class:`Mesh`.
        sets : mapping of str to array_like of int, optional
            As for :class:`Mesh`.
        first_order : bool
            As for :meth:`read`.

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
        for kind, cells, numbers in self._blocks():
            if kind.nodes == 27:
                cells = cells[:, _C3D27]
            for number, row in zip(numbers.tolist(), cells.tolist(), strict=True):
                rows[number] = (kind.abaqus, row)
        # elements keep the order of their numbers
        last = ""
        for number, (element_type, row) in enumerate(rows):
            if element_type != last:
                lines.append(f"*ELEMENT, TYPE={element_type}")
                last = element_type
            lines += _element_lines(number, row)
        for name, elements in self._of_bodies.items():
            if name in self.surfaces:
                raise ValueError(f"a body and a surface are both called {name!r}: rename one")
            lines.append(f"*ELSET, ELSET={_set_name(name, 'bodies')}")
            lines += map(str, elements.tolist())
        number = self.elements
        for name, faces in self._faces().items():
            counts = (faces >= 0).sum(axis=1)
            # the reader finds the centres of faces itself
            for element_type, count, written in (
                ("S3", 3, 3),
                ("S4", 4, 4),
                ("M3D6", 6, 6),
                ("M3D8", 9, 8),
            ):
                chosen = faces[counts == count, :written]
                if len(chosen):
                    lines.append(
                        f"*ELEMENT, TYPE={element_type}, ELSET={_set_name(name, 'surfaces')}"
                    )
                    for row in chosen.tolist():
                        lines += _element_lines(number, row)
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
        for kind, corners, numbers in self._blocks():
            if kind.nodes == 6 and older:
                corners = corners[:, [0, 2, 1, 3, 5, 4]]
            types[numbers] = kind.vtk
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

        blocks = self._blocks()
        data = {
            name: [np.asarray(values)[numbers] for _, _, numbers in blocks]
            for name, values in (cell_data or {}).items()
        }
        cells = [(kind.meshio, nodes) for kind, nodes, _ in blocks]
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
    return 1 if kind in _SMALL else 2 if kind in _FACETS else 3


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
    for kind, cells, positions in blocks:
        if kind in _FACETS:
            padded = np.full((len(cells), 4), -1, dtype=np.int64)
            padded[:, : _FACETS[kind]] = cells[:, : _FACETS[kind]]
            facets.append((padded, positions))
            continue
        if kind in _SMALL:
            small.append((cells, positions))
            continue
        if kind not in _CELLS:
            raise ValueError(
                f"{source} has {len(cells)} cells of type {kind}, which are not supported: "
                "mesh with hexahedra, wedges or tetrahedra, or remove them"
            )
        argument, _ = _CELLS[kind]
        corners, _ = _SHAPES[argument]
        if first_order:
            cells = cells[:, :corners]
        solids.setdefault(argument, []).append((cells, positions))
    if not solids:
        raise ValueError(f"{source} has no hexahedra, wedges or tetrahedra")
    arrays: dict[str, NDArray[np.int64]] = {}
    # number of each cell among the elements
    total = sum(len(positions) for _, _, positions in blocks)
    elements = np.full(total, -1, dtype=np.int64)
    first = 0
    for argument in _SHAPES:
        parts = solids.get(argument, [])
        if not parts:
            continue
        width = max(cells.shape[1] for cells, _ in parts)
        complete, lacking = _COMPLETE.get(argument, (0, 0))
        width = complete if width == lacking else width
        arrays[argument] = np.concatenate([_widened(cells, width) for cells, _ in parts])
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
    points, arrays, sets = _completed(points, arrays, sets)
    # keep only nodes that elements use: dropped nodes and points of geometry belong to none
    used = np.zeros(len(points), dtype=bool)
    for cells in arrays.values():
        used[cells[cells >= 0]] = True
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


def _widened(cells: NDArray[np.int64], columns: int) -> NDArray[np.int64]:
    """The same rows with -1 after their last node."""
    wide = np.full((len(cells), columns), -1, dtype=np.int64)
    wide[:, : cells.shape[1]] = cells
    return wide


def _completed(
    points: NDArray[np.float64], arrays: dict[str, NDArray[np.int64]], sets: dict[str, Any]
) -> tuple[NDArray[np.float64], dict[str, NDArray[np.int64]], dict[str, Any]]:
    """Hexahedra of 27 nodes and wedges of 18, numbered as in VTK, instead of those of 20 and 15, as
    the reader of case files makes them. The centre of a face belongs to a set if the other nodes of
    the face do."""
    second = {}
    for argument, (complete, _) in _COMPLETE.items():
        cells = arrays.get(argument, np.zeros((0, 0), np.int64))
        if cells.shape[1] != complete:
            cells = np.zeros((0, complete), np.int64)
        # linear ones have no ninth node
        second[argument] = cells[cells[:, 8] >= 0]
    if not any(map(len, second.values())):
        return points, arrays, sets
    points, *completed = _slipstick.second_order_elements(
        np.ascontiguousarray(points), *second.values()
    )
    arrays, faces = dict(arrays), []
    for (argument, before), after in zip(second.items(), completed, strict=True):
        if len(before):
            cells = arrays[argument].copy()
            cells[cells[:, 8] >= 0] = after
            arrays[argument] = cells
            quadrilaterals = _FACES_OF[after.shape[1]][-1]
            faces.append(after[before[:, -1] < 0][:, quadrilaterals].reshape(-1, 9))
    new = np.concatenate(faces)
    grown = {}
    for name, nodes in sets.items():
        chosen = np.zeros(len(points), dtype=bool)
        chosen[nodes] = True
        grown[name] = np.union1d(nodes, new[chosen[new[:, :8]].all(axis=1)][:, 8])
    return points, arrays, grown


def _both_orders(
    linear: tuple[NDArray[np.int64], NDArray[np.int64]],
    quadratic: tuple[NDArray[np.int64], NDArray[np.int64]],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Elements of both orders in one array, and their numbers, which ascend."""
    if len(linear[0]) == 0 or len(quadratic[0]) == 0:
        cells, numbers = quadratic if len(quadratic[0]) else linear
        return _arrays.frozen(cells), _arrays.frozen(numbers)
    cells = np.concatenate([_widened(linear[0], quadratic[0].shape[1]), quadratic[0]])
    numbers = np.concatenate([linear[1], quadratic[1]])
    order = np.argsort(numbers)
    return _arrays.frozen(cells[order]), _arrays.frozen(numbers[order])


def _element_lines(number: int, nodes: list[int]) -> list[str]:
    """An element in an Abaqus file."""
    entries = [str(entry) for entry in (number, *nodes)]
    parts = [entries[start : start + _LINE] for start in range(0, len(entries), _LINE)]
    return [",".join(part) + "," for part in parts[:-1]] + [",".join(parts[-1])]


def _cells(given: ArrayLike | None, name: str, count: int) -> NDArray[np.int64]:
    """Elements of one type."""
    corners, columns = _SHAPES[name]
    array = _arrays.rectangular([] if given is None else given, name)
    hint = ""
    lacking = _COMPLETE.get(name, (0, 0))[1]
    if lacking and array.shape[1:] == (lacking,):
        hint = f"; from_meshio and from_pyvista add the nodes that {name} of {lacking} nodes lack"
    found = _arrays.whole(array, name, columns, count, "nodes", required=corners, hint=hint)
    lacks = found < 0
    partly = np.flatnonzero(lacks.any(axis=1) & ~lacks[:, corners:].all(axis=1))
    if len(partly):
        raise ValueError(
            f"{name}[{partly[0]}] lacks mid-side nodes: give all {found.shape[1]} nodes, or -1 for "
            f"each except the {corners} corners of a linear element"
        )
    ascending = np.sort(found, axis=1)
    twice = ((np.diff(ascending, axis=1) == 0) & (ascending[:, 1:] >= 0)).any(axis=1)
    if twice.any():
        row = int(np.argmax(twice))
        raise ValueError(f"{name}[{row}] has a node twice: {found[row].tolist()}")
    return found if (found[:, -1] >= 0).any() else np.ascontiguousarray(found[:, :corners])


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
    found = _arrays.whole(given, place, (3, 4), count, "nodes", required=3)
    return _widened(found, 4)


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
