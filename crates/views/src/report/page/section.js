// Cuts elements by a plane across an axis.
const HEX_EDGES = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
// Points of the cut, each between two corners { ends: 2 per point, parts: of the way from the first to the second },
// and their coordinates; polygons [element, points in order], counter-clockwise seen from the side that is removed.
function sectionOf(hexes, points, solid, { axis, at, side }) {
  const ends = [], parts = [], coordinates = [], polygons = [], [u, w] = [(axis + 1) % 3, (axis + 2) % 3];
  for (let e = 0; e < hexes.length / 8; e++) {
    if (!solid(e)) continue;
    const n = hexes.subarray(8 * e, 8 * e + 8);
    let below = 0;
    for (let k = 0; k < 8; k++) below += points[3 * n[k] + axis] < at;
    if (below === 0 || below === 8) continue;
    // Edges of tetrahedra and wedges repeat.
    const first = ends.length / 2, known = new Set();
    for (const [a, b] of HEX_EDGES) {
      const [i, j] = n[a] < n[b] ? [n[a], n[b]] : [n[b], n[a]], [p, q] = [points[3 * i + axis] - at, points[3 * j + axis] - at];
      if ((p < 0) === (q < 0) || known.has(`${i} ${j}`)) continue;
      known.add(`${i} ${j}`);
      const part = p / (p - q);
      ends.push(i, j); parts.push(part);
      for (let c = 0; c < 3; c++) coordinates.push(c === axis ? at : points[3 * i + c] + part * (points[3 * j + c] - points[3 * i + c]));
    }
    const around = parts.slice(first).map((_, k) => first + k), mean = c => around.reduce((sum, k) => sum + coordinates[3 * k + c], 0) / around.length;
    const [mu, mw] = [mean(u), mean(w)], angle = k => side * Math.atan2(coordinates[3 * k + w] - mw, coordinates[3 * k + u] - mu);
    if (around.length > 2) polygons.push([e, around.map(k => [angle(k), k]).sort((a, b) => a[0] - b[0]).map(([, k]) => k)]);
  }
  return { ends, parts, coordinates, polygons };
}
// Quadrilaterals that fill a polygon of at most six points: their corners, and whether the last edge is inside it.
function filled(p) {
  if (p.length <= 4) return [[[p[0], p[1], p[2], p[p.length - 1]], false]];
  return [[p.slice(0, 4), true], [[p[3], p[4], p[5] ?? p[0], p[0]], true]];
}
// Both lists of numbers, one after the other.
function joined(a, b) {
  const all = new Float32Array(a.length + b.length);
  all.set(a); all.set(b, a.length);
  return all;
}
