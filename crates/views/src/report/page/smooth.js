// Rounds the staircase of elements between material and void: Taubin's filter (1995), which shrinks nothing. Points of
// outer faces stay in them: their rims slide along the faces, and all others are where they were.
const PASSES = 12, FLAT = 0.9;
const minus = (a, b) => a.map((v, k) => v - b[k]), along = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const crossed = (u, w) => [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
const direction = a => { const length = Math.sqrt(along(a, a)); return length > 0 ? a.map(v => v / length) : a; };
function smoothed(points, faces, solid) {
  const links = new Map(), outside = new Map(), inside = new Set(), size = points.length / 3;
  const p = n => [points[3 * n], points[3 * n + 1], points[3 * n + 2]];
  for (let f = 0; f < faces.sides.length / 2; f++) {
    const [a, b] = [faces.sides[2 * f], faces.sides[2 * f + 1]];
    if (solid(a) === solid(b)) continue;
    const corners = [0, 1, 2, 3].map(k => faces.nodes[4 * f + k]), outer = b < 0;
    const normal = outer && direction(crossed(minus(p(corners[2]), p(corners[0])), minus(p(corners[3]), p(corners[1]))));
    corners.forEach((n, k) => {
      const next = corners[(k + 1) % 4];
      if (n !== next) { const key = Math.min(n, next) * size + Math.max(n, next); links.set(key, (links.get(key) || 0) | (outer ? 1 : 2)); }
      if (!outer) { inside.add(n); return; }
      const known = outside.get(n) || [], same = known.findIndex(other => along(other, normal) > FLAT);
      if (same < 0) known.push(normal); else known[same] = direction(known[same].map((v, i) => v + normal[i]));
      outside.set(n, known);
    });
  }
  const around = new Map([...inside].map(n => [n, []]));
  for (const [key, kinds] of links) {
    const ends = [Math.floor(key / size), key % size];
    // along a rim, only its own points count
    ends.forEach((n, k) => { if (inside.has(n) && (!outside.has(n) || kinds === 3)) around.get(n).push(ends[1 - k]); });
  }
  for (const normals of outside.values()) normals.forEach((n, k) => {
    for (let j = 0; j < k; j++) { const part = along(n, normals[j]); n = n.map((v, i) => v - part * normals[j][i]); }
    normals[k] = direction(n);
  });
  let now = Float32Array.from(points);
  for (let pass = 0; pass < 2 * PASSES; pass++) {
    const next = now.slice(), factor = pass % 2 ? -0.53 : 0.5;
    for (const [n, others] of around) {
      if (!others.length) continue;
      let by = [0, 1, 2].map(c => others.reduce((sum, m) => sum + now[3 * m + c], 0) / others.length - now[3 * n + c]);
      for (const normal of outside.get(n) || []) { const part = along(by, normal); by = by.map((v, c) => v - part * normal[c]); }
      by.forEach((v, c) => { next[3 * n + c] += factor * v; });
    }
    now = next;
  }
  return now;
}
// Normals at the corners of quadrilaterals: means of those around a point, except beyond edges of 60 degrees.
function rounded(points, nodes) {
  const count = nodes.length / 4, p = n => [points[3 * n], points[3 * n + 1], points[3 * n + 2]], around = new Map();
  const areas = Array.from({ length: count }, (_, f) => {
    const c = [0, 1, 2, 3].map(k => p(nodes[4 * f + k]));
    return crossed(minus(c[2], c[0]), minus(c[3], c[1]));
  });
  const units = areas.map(direction);
  for (let i = 0; i < nodes.length; i++) { const f = i >> 2, of = around.get(nodes[i]); if (!of) around.set(nodes[i], [f]); else if (of[of.length - 1] !== f) of.push(f); }
  return (f, k) => around.get(nodes[4 * f + k]).reduce((sum, g) => along(units[f], units[g]) > 0.5 ? sum.map((v, c) => v + areas[g][c]) : sum, [0, 0, 0]);
}
