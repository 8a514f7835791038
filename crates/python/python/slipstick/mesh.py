"""The mesh of a problem as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _slipstick

if TYPE_CHECKING:
    import meshio
    import pyvista

__all__ = ["Body", "Mesh"]


@dataclass(frozen=True)
class Body:
    """A body: ranges of the elements and the nodes of the mesh.

    Attributes
    ----------
    elements, nodes : slice
        For arrays over elements, such as densities, and over nodes.
    """

    elements: slice
    nodes: slice


@dataclass(frozen=True)
class Mesh:
    """The mesh of all bodies, in its reference configuration. Do not change its arrays.

    Nodes and elements are numbered from 0. Elements of the three types share one numbering, that of
    densities; ``hexahedron_numbers`` and its siblings say which element a row belongs to.

    Attributes
    ----------
    nodes : ndarray, shape (nodes, 3)
        Coordinates, in units of length.
    hexahedra, wedges, tetrahedra : ndarray of int, shapes (k, 8), (k, 6), (k, 4)
        Nodes of the elements. Hexahedra and tetrahedra are numbered as in VTK, wedges as in Gmsh.
    hexahedron_numbers, wedge_numbers, tetrahedron_numbers : ndarray of int, shape (k,)
        Numbers of these elements.
    volumes : ndarray, shape (elements,)
        Volumes of all elements.
    bodies : mapping of str to Body
        The bodies by name, in the order of their elements.
    sets : mapping of str to ndarray of int
        Nodes of every node set and surface, ascending.
    surfaces : mapping of str to ndarray of int, shape (facets, 4)
        Corners of the facets of every surface, counter-clockwise seen from outside; the fourth
        corner of a triangle is -1.

    Examples
    --------
    >>> import slipstick as ss
    >>> mesh = ss.Case.template("cube-on-cuboid").build().mesh
    >>> mesh.nodes.shape, mesh.hexahedra.shape, list(mesh.bodies)
    ((28, 3), (5, 8), ['cuboid', 'cube'])
    >>> mesh.sets["cube_ymin"]
    array([20, 21, 24, 25])
    """

    nodes: NDArray[np.float64]
    hexahedra: NDArray[np.int64]
    wedges: NDArray[np.int64]
    tetrahedra: NDArray[np.int64]
    hexahedron_numbers: NDArray[np.int64] = field(repr=False)
    wedge_numbers: NDArray[np.int64] = field(repr=False)
    tetrahedron_numbers: NDArray[np.int64] = field(repr=False)
    volumes: NDArray[np.float64] = field(repr=False)
    bodies: Mapping[str, Body]
    sets: Mapping[str, NDArray[np.int64]] = field(repr=False)
    surfaces: Mapping[str, NDArray[np.int64]] = field(repr=False)

    @classmethod
    def _of(cls, problem: _slipstick.Problem) -> Mesh:
        hexahedra, hexahedron_numbers = problem.elements(8)
        wedges, wedge_numbers = problem.elements(6)
        tetrahedra, tetrahedron_numbers = problem.elements(4)
        bodies = {
            name: Body(slice(*elements), slice(*nodes))
            for name, elements, nodes in problem.bodies()
        }
        return cls(
            nodes=problem.nodes(),
            hexahedra=hexahedra,
            wedges=wedges,
            tetrahedra=tetrahedra,
            hexahedron_numbers=hexahedron_numbers,
            wedge_numbers=wedge_numbers,
            tetrahedron_numbers=tetrahedron_numbers,
            volumes=problem.volumes(),
            bodies=bodies,
            sets=problem.sets(),
            surfaces=problem.surfaces(),
        )

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.volumes)

    def __repr__(self) -> str:
        bodies = ", ".join(self.bodies)
        return f"<Mesh: {len(self.nodes)} nodes, {self.elements} elements, bodies {bodies}>"

    def to_pyvista(
        self,
        cell_data: Mapping[str, Any] | None = None,
        point_data: Mapping[str, Any] | None = None,
        displacement: NDArray[np.float64] | None = None,
    ) -> pyvista.UnstructuredGrid:
        """The mesh for PyVista, with the elements in the order of their numbers.

        Parameters
        ----------
        cell_data, point_data : mapping of str to array, optional
            Arrays over elements, such as densities, and over nodes.
        displacement : ndarray, shape (nodes, 3), optional
            Displacements that are added to the coordinates.

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
        """The mesh for meshio, with the node sets and a block for each type of element.

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
