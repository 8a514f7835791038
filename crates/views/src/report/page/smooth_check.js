// A block of 8 x 8 x 8 elements, of which those below a diagonal plane are material: their rounded surface keeps the
// volume and the outer faces of the block, and is nearly flat.
const N = 8, id = (i, j, k) => i + (N + 1) * (j + (N + 1) * k), grid = [], hexes = [], material = [];
for (let k = 0; k <= N; k++) for (let j = 0; j <= N; j++) for (let i = 0; i <= N; i++) grid.push(i, j, k);
for (let k = 0; k < N; k++) for (let j = 0; j < N; j++) for (let i = 0; i < N; i++) {
  hexes.push(id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k), id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1));
  material.push(i + j < N);
}
const before = Float32Array.from(grid), faces = facesOf(Uint32Array.from(hexes), before.length / 3), solid = e => e >= 0 && material[e];
function volume(points) {
  let sum = 0;
  for (let f = 0; f < faces.sides.length / 2; f++) {
    const [a, b] = [faces.sides[2 * f], faces.sides[2 * f + 1]];
    if (solid(a) === solid(b)) continue;
    const c = [0, 1, 2, 3].map(k => { const n = faces.nodes[4 * f + (solid(a) ? k : 3 - k)]; return [0, 1, 2].map(i => points[3 * n + i]); });
    for (const [p, q] of [[1, 2], [2, 3]]) sum += along(c[0], crossed(c[p], c[q])) / 6;
  }
  return sum;
}
const after = smoothed(before, faces, solid), distance = n => Math.abs(after[3 * n] + after[3 * n + 1] - N - 0.5);
let left = 0, rough = 0;
before.forEach((x, i) => { if (x === 0 || x === N) left = Math.max(left, Math.abs(after[i] - x)); });
for (let k = 2; k < 7; k++) for (let i = 2; i < 7; i++) for (const j of [N - i, N - i + 1]) rough = Math.max(rough, distance(id(i, j, k)));
const nodes = [];
for (let f = 0; f < faces.sides.length / 2; f++) if (solid(faces.sides[2 * f]) !== solid(faces.sides[2 * f + 1])) nodes.push(...faces.nodes.slice(4 * f, 4 * f + 4));
const finite = rounded(after, nodes)(0, 0).every(Number.isFinite);
console.log(Math.abs(volume(before) - 288) < 1e-6 && Math.abs(volume(after) - 288) < 3 && left === 0 && rough < 0.1 && finite);
