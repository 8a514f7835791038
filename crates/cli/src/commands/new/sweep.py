def combined(*terms):
    """The sum of vectors with factors: (factor, vector), ..."""
    return [sum(factor * vector[c] for factor, vector in terms) for c in range(3)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = dot(a, a) ** 0.5
    return [c / length for c in a]


def across(axis):
    """A unit vector perpendicular to another one."""
    return unit(cross(axis, min(([1, 0, 0], [0, 1, 0], [0, 0, 1]), key=lambda e: abs(dot(e, axis)))))


def close(one, other):
    """Whether two numbers agree to a millionth."""
    return abs(one - other) <= 1e-6 * max(abs(one), abs(other))


class Line:
    """A sweep along a straight line. A station is the distance from the origin along it."""

    def __init__(self, axis):
        self.axis, self.origin, self.layers_at_least = axis, [0.0, 0.0, 0.0], 2

    def along(self, point):
        """The direction of the sweep at a point."""
        return self.axis

    def station(self, point):
        return dot(point, self.axis)

    def moved(self, point, by):
        return combined((1, point), (by, self.axis))

    def move(self, shapes, by):
        gmsh.model.occ.translate(shapes, *(by * c for c in self.axis))

    def corners(self, middle, station, size):
        """A plane at a station that contains the section of the body."""
        u = across(self.axis)
        v, centre = cross(self.axis, u), self.moved(middle, station - self.station(middle))
        return [combined((1, centre), (i * size, u), (j * size, v)) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]

    def segments(self, stations):
        return list(zip(stations, stations[1:]))

    def sweep(self, cells, by, size):
        layers = max(self.layers_at_least, round(by / size))
        return gmsh.model.occ.extrude(cells, *(by * c for c in self.axis), numElements=[layers], recombine=True)


class Arc:
    """A sweep around an axis. A station is an angle."""

    def __init__(self, origin, axis):
        self.origin, self.axis, self.u, self.radius = origin, axis, across(axis), 0.0
        self.v = cross(axis, self.u)

    def polar(self, point):
        """Radius, angle and height of a point."""
        away = combined((1, point), (-1, self.origin))
        x, y = dot(away, self.u), dot(away, self.v)
        return math.hypot(x, y), math.atan2(y, x) % math.tau, dot(away, self.axis)

    def at(self, radius, angle, height):
        x, y = radius * math.cos(angle), radius * math.sin(angle)
        return combined((1, self.origin), (x, self.u), (y, self.v), (height, self.axis))

    def along(self, point):
        radius, angle, _ = self.polar(point)
        self.radius = max(self.radius, radius)
        return combined((-math.sin(angle), self.u), (math.cos(angle), self.v))

    def station(self, point):
        radius, angle, _ = self.polar(point)
        return angle if radius > 1e-6 * self.radius else None

    def moved(self, point, by):
        radius, angle, height = self.polar(point)
        return self.at(radius, angle + by, height)

    def move(self, shapes, by):
        gmsh.model.occ.rotate(shapes, *self.origin, *self.axis, by)

    def corners(self, middle, station, size):
        height = self.polar(middle)[2]
        return [self.at(r, station, height + h) for r, h in ((0, -size), (2 * size, -size), (2 * size, size), (0, size))]

    def segments(self, stations):
        """Of the whole circle, each at most a third."""
        found = []
        for start, end in zip(stations, [*stations[1:], stations[0] + math.tau]):
            pieces = math.ceil((end - start) / (math.tau / 3) - 1e-6)
            found += [[start + (end - start) * (i + k) / pieces for k in (0, 1)] for i in range(pieces)]
        return found

    def sweep(self, cells, by, size):
        layers = max(1, math.ceil(by / math.tau * PER_CIRCLE - 1e-6), round(by * self.radius / size))
        return gmsh.model.occ.revolve(cells, *self.origin, *self.axis, by, numElements=[layers], recombine=True)


def mean(points):
    return [sum(p[c] for p in points) / len(points) for c in range(3)]


def circles(solid):
    """The axes of the circular edges of a solid: a point and a direction."""
    found = []
    for _, edge in gmsh.model.getBoundary([(3, solid)], combined=False, recursive=False, oriented=False):
        for _, curve in gmsh.model.getBoundary([(2, edge)], combined=False, oriented=False):
            (low,), (high,) = gmsh.model.getParametrizationBounds(1, curve)
            flat = gmsh.model.getValue(1, curve, [low + (high - low) * s for s in (0.0, 0.2, 0.45, 0.7)])
            p, q, r, s = [list(flat[i : i + 3]) for i in range(0, 12, 3)]
            a, b = combined((1, q), (-1, p)), combined((1, r), (-1, p))
            normal = cross(a, b)
            twice = 2 * dot(normal, normal)
            if twice < 1e-9 * dot(a, a) * dot(b, b):
                continue
            away = combined((dot(b, b) / twice, cross(normal, a)), (-dot(a, a) / twice, cross(normal, b)))
            away = combined((-1, away)) if dot(away, combined((1, a), (1, b))) < 0 else away
            centre, axis = combined((1, p), (1, away)), unit(normal)
            away = combined((1, s), (-1, centre))
            radius = dot(combined((1, p), (-1, centre)), combined((1, p), (-1, centre))) ** 0.5
            if abs(dot(away, away) ** 0.5 - radius) > 1e-6 * radius or abs(dot(away, axis)) > 1e-6 * radius:
                continue
            for other, along in found:
                gap = cross(combined((1, centre), (-1, other)), along)
                if dot(gap, gap) ** 0.5 < 1e-6 * radius and abs(dot(axis, along)) > 1 - 1e-9:
                    break
            else:
                found.append((centre, axis))
    return found


def inner_point(face):
    """A point inside a face."""
    low, high = gmsh.model.getParametrizationBounds(2, face)
    for count in (1, 3, 7, 19):
        for i in range(count):
            for j in range(count):
                uv = [low[k] + (high[k] - low[k]) * (n + 0.5) / count for k, n in ((0, i), (1, j))]
                if gmsh.model.isInside(2, face, uv, parametric=True):
                    return list(gmsh.model.getValue(2, face, uv))
    return list(gmsh.model.occ.getCenterOfMass(2, face))


def ways(solid, faces):
    """The lines and arcs along which each face is either swept or a section."""
    found = []
    for face in faces:
        if face.kind == "Plane" and face.normals:
            axis = unit(face.normals[0])
            if not any(abs(dot(axis, way.axis)) > 1 - 1e-9 for way in found):
                found.append(Line(axis))
    found += [Arc(*circle) for circle in circles(solid)]

    def suits(way):
        for face in faces:
            cosines = [abs(dot(n, way.along(p))) for p, n in zip(face.points, face.normals)]
            section = face.kind == "Plane" and all(c > 1 - 1e-6 for c in cosines)
            if not cosines or not (section or all(c < 1e-5 for c in cosines)):
                return False
        return True

    return [way for way in found if suits(way)]


def sections(way, faces):
    """The plane faces across the sweep."""
    return [face for face in faces if abs(dot(face.normals[0], way.along(face.points[0]))) > 0.5]


def unstacked(way, solid, faces):
    """Sorts ways: lines first, then few sections, then the section with the most edges, then the largest."""
    ends = sections(way, faces)
    edges = [len(gmsh.model.getBoundary([(2, face.tag)], oriented=False)) for face in ends]
    return isinstance(way, Arc), len(ends), -max(edges, default=0), -max((face.area for face in ends), default=0.0)


def sweep(way, solid, faces, size):
    """The solids that replace a solid, swept along a way in layers; for each of its faces, the new faces that lie on
    it; whether the solids go all around; and the sections to mesh with quadrangles. None if volume and areas of the
    new solids differ by more than a millionth."""
    occ = gmsh.model.occ
    before = set(gmsh.model.getEntities())
    low, high = box(3, solid)
    extent = dot(combined((1, high), (-1, low)), combined((1, high), (-1, low))) ** 0.5
    middle, volume = mean([low, high]), occ.getMass(3, solid)
    corners = gmsh.model.getBoundary([(3, solid)], recursive=True, oriented=False)
    corners = [list(gmsh.model.getValue(0, tag, [])) for _, tag in corners]
    stations = sorted(s for s in (way.station(corner) for corner in corners) if s is not None)
    small = 1e-6 * (extent if isinstance(way, Line) else 1.0)
    stations = [s for i, s in enumerate(stations) if i == 0 or s - stations[i - 1] > small]
    if isinstance(way, Arc) and len(stations) > 1 and stations[0] + math.tau - stations[-1] < small:
        stations.pop()

    def undo():
        occ.synchronize()
        new = [entity for entity in gmsh.model.getEntities() if entity not in before]
        occ.remove(sorted(new, reverse=True), recursive=False)
        occ.synchronize()

    # the section in the middle of each segment
    segments, cuts, ends = [], [], sections(way, faces)
    for start, end in way.segments(stations):
        points = [occ.addPoint(*p) for p in way.corners(middle, (start + end) / 2, extent)]
        lines = [occ.addLine(points[i - 1], points[i]) for i in range(4)]
        plane = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        cut, _ = occ.intersect([(3, solid)], [(2, plane)], removeObject=False, removeTool=True)
        cut = [entity for entity in cut if entity[0] == 2]
        segments.append((start, end))
        # a face across the sweep is exact; where it has the same area, it replaces the section of a curved surface
        exact = [face for face in ends if len(cut) == 1 and abs(occ.getMass(*cut[0]) / face.area - 1) < 1e-4]
        if exact:
            occ.remove(cut, recursive=True)
            cut = occ.copy([(2, exact[0].tag)])
            way.move(cut, (start + end) / 2 - way.station(exact[0].points[0]))
        cuts.append(cut)
    gaps = [i for i, cut in enumerate(cuts) if not cut]
    if len(gaps) == len(cuts):
        undo()
        return None
    first = (gaps[0] + 1) % len(cuts) if gaps else 0
    order = [(first + i) % len(cuts) for i in range(len(cuts))]
    order = [i for i in order if cuts[i]]
    base = segments[order[0]][0]

    # all of them in the first plane, with the faces across the sweep and the corners between
    flat = []
    for i in order:
        way.move(cuts[i], base - sum(segments[i]) / 2)
        flat += cuts[i]
    for face in ends:
        copy = occ.copy([(2, face.tag)])
        way.move(copy, base - way.station(face.points[0]))
        flat += copy
    marks = []
    for corner in corners:
        if way.station(corner) is not None:
            marks.append((0, occ.addPoint(*way.moved(corner, base - way.station(corner)))))
    cells, _ = occ.fragment(flat, marks)
    occ.remove([entity for entity in cells if entity[0] == 0], recursive=False)
    cells = sorted({entity for entity in cells if entity[0] == 2})
    occ.synchronize()

    # swept, and without what is not in the body
    new, last, across_sweep = [], cells, list(cells)
    inner = [inner_point(tag) for _, tag in cells]
    if isinstance(way, Line):
        way.layers_at_least = 2 if len(order) == 1 else 1
    for i in order:
        start, end = segments[i]
        made = way.sweep(last, end - start, size)
        last = [made[j - 1] for j, (dim, _) in enumerate(made) if dim == 3]  # Gmsh lists the end of each first
        across_sweep += last
        for point, (dim, tag) in zip(inner, (entity for entity in made if entity[0] == 3)):
            there = way.moved(point, (start + end) / 2 - base)
            new.append((tag, gmsh.model.isInside(3, solid, there) > 0))
    occ.remove([(3, tag) for tag, inside in new if not inside], recursive=True)
    occ.synchronize()
    new = [tag for tag, inside in new if inside]
    closed = isinstance(way, Arc) and not gaps
    skin = {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in new], oriented=False)}
    if closed:
        skin -= {tag for _, tag in [*cells, *last]}
    found = {face.tag: set() for face in faces}
    for tag in skin:
        point = inner_point(tag)
        for face in faces:
            if apart(face.box, box(2, tag), 1e-6 * extent):
                continue
            there, _ = gmsh.model.getClosestPoint(2, face.tag, point)
            if dot(combined((1, there), (-1, point)), combined((1, there), (-1, point))) ** 0.5 > 1e-5 * extent:
                continue
            if gmsh.model.isInside(2, face.tag, list(there)):
                found[face.tag].add(tag)
                break
    agree = close(sum(occ.getMass(3, tag) for tag in new), volume) and all(
        close(sum(occ.getMass(2, tag) for tag in found[face.tag]), face.area) for face in faces
    )
    kept = {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in new], combined=False, oriented=False)}
    edges = {tag for _, tag in gmsh.model.getBoundary([(2, tag) for tag in kept], combined=False, oriented=False)}
    known = {tag for _, tag in gmsh.model.getBoundary([(2, face.tag) for face in faces], combined=False, oriented=False)}
    shortest = lambda some: min(occ.getMass(1, tag) for tag in some)
    if not agree or shortest(edges) < min(0.1 * size, 0.5 * shortest(known)):
        undo()
        return None
    # of a whole revolution, Gmsh copies any of the sections to the others
    sources = across_sweep if closed else cells
    return new, found, closed, [tag for _, tag in sources if tag in kept]


def swept(solid, faces, size, planned, quadrangles):
    """Replaces a solid by swept ones if it can. Returns their tags, those of its faces, and whether they go all around
    an axis, or None; the plan, which is the number of the way and, if there is none, the reason; and whether ways
    were tried in vain. With a plan, only this way is tried: Gmsh would mesh a solid by what is left of those. Sections
    consist of `quadrangles` as far as possible, or of triangles."""
    reason, vain = "is neither a prism nor a body of revolution", False
    for number, way in enumerate(sorted(ways(solid, faces), key=lambda way: unstacked(way, solid, faces))):
        if planned and planned[0] != number:
            continue
        if isinstance(way, Arc) and touches_axis(way, solid):
            reason = "reaches its axis of revolution"
            continue
        found = sweep(way, solid, faces, size)
        if found:
            gmsh.model.occ.remove([(3, solid)], recursive=True)
            gmsh.model.occ.synchronize()
            *found, cells = found
            for cell in cells if quadrangles else []:
                gmsh.model.mesh.setRecombine(2, cell)
                gmsh.model.mesh.setAlgorithm(2, cell, 8)  # triangles that join to regular quadrangles
            return found, (number, ""), vain
        vain = True
    return None, planned or (None, reason), vain


def touches_axis(way, solid):
    """Whether a solid contains a point of the axis."""
    low, high = box(3, solid)
    for _, tag in gmsh.model.getBoundary([(3, solid)], recursive=True, oriented=False):
        if way.station(gmsh.model.getValue(0, tag, [])) is None:
            return True
    middle, extent = mean([low, high]), sum(b - a for a, b in zip(low, high))
    height = way.polar(middle)[2]
    return any(gmsh.model.isInside(3, solid, way.at(0, 0, height + extent * (i / 50 - 0.5))) for i in range(51))
