// Draws the skin of elements with WebGL: colours by a value per corner, flat or smooth shading, element edges.
function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}
// Converts { bits, low, step, data } to numbers.
function unpacked(packed) {
  const bytes = bytesOf(packed.data), codes = packed.bits === 8 ? bytes : new Uint16Array(bytes.buffer);
  return Float32Array.from(codes, code => packed.low + packed.step * code);
}
// Faces of hexahedra with the elements on both sides: { nodes: 4 per face, sides: 2 per face, -1 outside }.
// Tetrahedra and wedges are hexahedra with repeated corners: faces with three distinct corners are triangles, those
// with fewer are dropped.
const HEX_FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
function facesOf(hexes, points) {
  const known = new Map(), nodes = [], sides = [];
  for (let e = 0; e < hexes.length / 8; e++) {
    for (const face of HEX_FACES) {
      const n = face.map(k => hexes[8 * e + k]), least = n.indexOf(Math.min(...n));
      // No two faces of a mesh share a diagonal, so the smallest corner and the opposite one identify a face.
      let key = n[least] * points + n[(least + 2) % 4];
      if (hexes[8 * e + 2] === hexes[8 * e + 3]) {
        const corners = [...new Set(n)].sort((a, b) => a - b);
        if (corners.length < 3) continue;
        if (corners.length < 4) key = corners.join();
      }
      const found = known.get(key);
      if (found === undefined) { known.set(key, sides.length / 2); nodes.push(...n); sides.push(e, -1); } else sides[2 * found + 1] = e;
    }
  }
  return { nodes: Uint32Array.from(nodes), sides: Int32Array.from(sides) };
}
const VERTEX = `attribute vec3 at; attribute vec3 normal; attribute float value; uniform mat3 turn; uniform vec3 centre, scale; uniform vec4 plane; uniform vec2 shift; uniform float nearer; uniform vec3 palette[14]; varying vec3 n, named; varying float v, beyond;
vec3 chosen(float k) { vec3 c = vec3(1.0); for (int i = 0; i < 14; i++) if (abs(k - float(i)) < 0.5) c = palette[i]; return c; }
void main() { named = value < -2.5 ? chosen(-3.0 - value) : vec3(1.0); vec3 p = turn * (at - centre); beyond = dot(at - centre, plane.xyz) - plane.w; n = turn * normal; v = value; gl_Position = vec4((p.xy + shift) * scale.xy, -p.z * scale.z - nearer, 1.0); }`;
const FRAGMENT = `#ifdef GL_FRAGMENT_PRECISION_HIGH
precision highp float;
#else
precision mediump float;
#endif
varying vec3 n, named; varying float v, beyond; uniform vec3 plain; uniform float kind;
vec3 map(float t) {
  vec3 c0 = vec3(.2777, .0054, .3341), c1 = vec3(.1051, 1.4046, 1.3846), c2 = vec3(-.3309, .2148, .0951), c3 = vec3(-4.6342, -5.7991, -19.3324), c4 = vec3(6.2283, 14.1799, 56.6906), c5 = vec3(4.7764, -13.7451, -65.3530), c6 = vec3(-5.4355, 4.6459, 26.3124);
  return clamp(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6))))), 0.0, 1.0);
}
void main() {
  if (beyond > 1e-4) discard;
  if (kind > 1.5) { gl_FragColor = vec4(plain, 1.0); return; }
  vec3 c = v < -2.5 ? named : v < -1.5 ? vec3(.85, .81, .745) : v < -0.5 ? plain : (kind > 0.5 ? (v < .25 ? vec3(.62, .66, .70) : v < .75 ? vec3(.13, .40, .67) : vec3(.84, .38, .10)) : map(clamp(v, 0.0, 1.0)));
  vec3 u = normalize(n); if (u.z < 0.0) u = -u;
  // of the pictures: from everywhere and above, a key and a fill; the power is that of the display
  float light = pow(min(1.0, 0.325 + 0.125 * u.y + 0.5 * max(0.0, dot(u, vec3(-.34, .59, .73))) + 0.15 * max(0.0, dot(u, vec3(.84, .11, .53)))), 0.4545);
  gl_FragColor = vec4(c * light, 1.0);
}`;
function program(gl) {
  const built = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(built, shader);
  }
  gl.linkProgram(built);
  return built;
}
const OPEN = [[0, 1], [1, 2], [2, 3]], CLOSED = [...OPEN, [3, 0]];
const SLOW_FRAME = 50, REST = 250; // ms
const ROUGH = 40, FEW = 20000; // cells of the rough view across the model, corners for which it is not needed
class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL");
    this.program = program(gl);
    gl.useProgram(this.program);
    gl.enable(gl.DEPTH_TEST);
    const kinds = ["faces", "rough", "edges", "over", "outline"];
    this.buffers = Object.fromEntries(kinds.map(name => [name, gl.createBuffer()]));
    this.counts = Object.fromEntries(kinds.map(name => [name, 0]));
    this.places = Object.fromEntries(["turn", "centre", "scale", "shift", "plane", "palette", "kind", "nearer", "plain"].map(name => [name, gl.getUniformLocation(this.program, name)]));
    this.edges = true;
    this.reset();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }
  reset() { this.yaw = -0.65; this.pitch = 0.5; this.zoom = 1; this.shift = [0, 0]; }
  frame(points) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; i++) { low[i % 3] = Math.min(low[i % 3], points[i]); high[i % 3] = Math.max(high[i % 3], points[i]); }
    this.box = [low, high];
    this.centre = low.map((l, k) => 0.5 * (l + high[k]));
    this.radius = 0.5 * Math.hypot(...low.map((l, k) => high[k] - l)) || 1;
  }
  // Positions of the points; per face 4 points, 4 values from 0 to 1 (-1: none, -2: the material of a design) and the element behind it (-1: none).
  // A section removes what lies beyond a plane, { axis, at, side }; `inner` are faces whose last edge is not drawn.
  show(points, nodes, values, owners, section = null, inner = new Set(), smooth = false) {
    const gl = this.gl, count = nodes.length / 4, faces = new Float32Array(count * 42), edges = new Float32Array(count * 56), drawn = new Set();
    let f = 0, e = 0;
    const p = n => [points[3 * n], points[3 * n + 1], points[3 * n + 2]], normal = smooth && rounded(points, nodes);
    for (let i = 0; i < count; i++) {
      const corner = [0, 1, 2, 3].map(k => p(nodes[4 * i + k]));
      const [u, w] = [0, 1].map(k => corner[k + 2].map((c, j) => c - corner[k][j]));
      const n = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
      const put = (array, at, k) => { array.set(corner[k], at); array.set(normal ? normal(i, k) : n, at + 3); array[at + 6] = values[4 * i + k]; };
      for (const k of [0, 1, 2, 0, 2, 3]) { put(faces, f, k); f += 7; }
      for (const [k, l] of inner.has(i) ? OPEN : CLOSED) {
        const [a, b] = [nodes[4 * i + k], nodes[4 * i + l]], edge = a < b ? a * points.length + b : b * points.length + a;
        if (a === b || drawn.has(edge)) continue;
        drawn.add(edge);
        put(edges, e, k); put(edges, e + 7, l); e += 14;
      }
    }
    for (const [name, data] of [["faces", faces], ["edges", edges.subarray(0, e)]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      this.counts[name] = data.length / 7;
    }
    this.shown = { points, nodes, owners, section };
    this.fine = values;
    this.counts.rough = 0;
    this.draw();
  }
  // The same faces with points moved together that lie in the same cell of a grid: fewer faces, without gaps.
  roughen() {
    const gl = this.gl, { points, nodes } = this.shown, size = 2 * this.radius / ROUGH, [low] = this.box, first = new Map(), data = [];
    const moved = n => { const key = [0, 1, 2].reduce((sum, c) => sum * 4096 + Math.floor((points[3 * n + c] - low[c]) / size) + 1024, 0); if (!first.has(key)) first.set(key, n); return first.get(key); };
    for (let i = 0; i < nodes.length / 4; i++) {
      const corners = [0, 1, 2, 3].map(k => moved(nodes[4 * i + k])), at = corners.map(n => [points[3 * n], points[3 * n + 1], points[3 * n + 2]]);
      for (const three of [[0, 1, 2], [0, 2, 3]]) {
        const [a, b, c] = three.map(k => corners[k]);
        if (a === b || b === c || c === a) continue;
        const [p, q, r] = three.map(k => at[k]), u = q.map((x, j) => x - p[j]), w = r.map((x, j) => x - p[j]), normal = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
        three.forEach(k => data.push(...at[k], ...normal, this.fine[4 * i + k]));
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.rough); gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(data), gl.STATIC_DRAW);
    this.counts.rough = data.length / 7;
  }
  // Faces that are drawn in front of others at the same place, with an outline that shows through all others.
  over(faces, points) {
    const gl = this.gl, filled = [], lines = [], ends = new Map(), p = n => [points[3 * n], points[3 * n + 1], points[3 * n + 2], 0, 0, 0, -4];
    for (const c of faces) {
      for (const k of [0, 1, 2, 0, 2, 3]) filled.push(...p(c[k]));
      c.forEach((a, k) => { const b = c[(k + 1) % 4], name = a < b ? `${a} ${b}` : `${b} ${a}`; if (a !== b) ends.set(name, ends.has(name) ? null : [a, b]); });
    }
    for (const pair of ends.values()) if (pair) lines.push(...p(pair[0]), ...p(pair[1]));
    for (const [name, data] of [["over", filled], ["outline", lines]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]); gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(data), gl.STATIC_DRAW);
      this.counts[name] = data.length / 7;
    }
    this.draw();
  }
  // Marks the middle of the view, for the keyboard.
  aim(on) {
    this.canvas.parentElement.classList.toggle("aiming", on);
    this.aiming = on;
  }
  turn() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [cy, 0, sy, sp * sy, cp, -sp * cy, -cp * sy, sp, cp * cy]; // rows
  }
  scale() {
    const { clientWidth: w, clientHeight: h } = this.canvas, unit = this.zoom / this.radius;
    return w > h ? [unit * h / w, unit] : [unit, unit * w / h];
  }
  // Normal and distance from the centre, in units of the radius; what lies beyond is not drawn.
  plane() {
    const cut = this.shown && this.shown.section, plane = [0, 0, 0, 1];
    if (cut) { plane[cut.axis] = cut.side / this.radius; plane[3] = cut.side * (cut.at - this.centre[cut.axis]) / this.radius; }
    return plane;
  }
  draw() {
    const { gl, canvas } = this, ratio = Math.min(devicePixelRatio || 1, 2) * (this.coarse ? 0.5 : 1);
    if (!this.centre) return;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight].map(size => Math.max(1, Math.round(size * ratio)));
    // setting a size makes the canvas anew, even if it is the same
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const at = name => this.places[name], t = this.turn(), [sx, sy] = this.scale();
    gl.uniformMatrix3fv(at("turn"), false, [t[0], t[3], t[6], t[1], t[4], t[7], t[2], t[5], t[8]]);
    gl.uniform3fv(at("centre"), this.centre);
    gl.uniform3f(at("scale"), sx, sy, 0.2 / this.radius);
    gl.uniform2fv(at("shift"), this.shift);
    gl.uniform4fv(at("plane"), this.plane());
    if (this.palette) gl.uniform3fv(at("palette"), this.palette.flatMap(c => [1, 3, 5].map(k => (parseInt(c.slice(k, k + 2), 16) / 255))));
    const pass = (name, mode, kind, colour, nearer) => {
      if (!this.counts[name]) return;
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      [["at", 3, 0], ["normal", 3, 12], ["value", 1, 24]].forEach(([attribute, size, offset]) => {
        const place = gl.getAttribLocation(this.program, attribute);
        if (place >= 0) { gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, size, gl.FLOAT, false, 28, offset); }
      });
      gl.uniform1f(at("kind"), kind); gl.uniform1f(at("nearer"), nearer); gl.uniform3fv(at("plain"), colour);
      gl.drawArrays(mode, 0, this.counts[name]);
    };
    if (this.coarse && !this.counts.rough && this.counts.faces > FEW) this.roughen();
    pass(this.coarse && this.counts.rough ? "rough" : "faces", gl.TRIANGLES, this.categories ? 1 : 0, [0.72, 0.75, 0.79], 0);
    pass("over", gl.TRIANGLES, 2, [0.98, 0.82, 0.1], 0.0003);
    if (this.edges && !this.coarse) pass("edges", gl.LINES, 2, [0.18, 0.2, 0.23], 0.0006);
    if (this.counts.outline) { gl.disable(gl.DEPTH_TEST); pass("outline", gl.LINES, 2, [0.6, 0.35, 0], 0); gl.enable(gl.DEPTH_TEST); }
    if (this.onturn) this.onturn();
  }
  // Draws with the next frame, once for all movements before it. If frames come slowly, it draws roughly, without edges,
  // until the movement has ended.
  redraw() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => { this.slow = 0; if (this.coarse) { this.coarse = false; this.draw(); } }, REST);
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(now => {
      this.asked = false;
      const took = now - (this.before || 0);
      this.before = now;
      // the time since the frame before, unless the reader has paused
      if (took < 10 * SLOW_FRAME) this.slow = took > SLOW_FRAME ? (this.slow || 0) + 1 : 0;
      if (this.slow > 1) this.coarse = true;
      this.draw();
    });
  }
  // The face under a point of the canvas, or -1.
  pick(x, y) {
    if (!this.shown) return -1;
    const { points, nodes } = this.shown, t = this.turn(), [sx, sy] = this.scale(), { clientWidth: w, clientHeight: h } = this.canvas;
    const [qx, qy] = [(2 * x / w - 1) / sx - this.shift[0], (1 - 2 * y / h) / sy - this.shift[1]];
    let best = -1, depth = -Infinity;
    const [nx, ny, nz, limit] = this.plane(), normal = [0, 3, 6].map(r => t[r] * nx + t[r + 1] * ny + t[r + 2] * nz);
    for (let i = 0; i < nodes.length / 4; i++) {
      const c = [0, 1, 2, 3].map(k => { const n = nodes[4 * i + k], d = [0, 1, 2].map(j => points[3 * n + j] - this.centre[j]); return [0, 3, 6].map(r => t[r] * d[0] + t[r + 1] * d[1] + t[r + 2] * d[2]); });
      const inside = c.every((a, k) => { const b = c[(k + 1) % 4]; return (b[0] - a[0]) * (qy - a[1]) - (b[1] - a[1]) * (qx - a[0]) >= 0; });
      if (!inside) continue;
      // the depth of the face below the point: of the plane through its middle, also for triangles
      const [u, v] = [0, 1].map(k => c[k + 2].map((x, j) => x - c[k][j])), facing = u[0] * v[1] - u[1] * v[0];
      if (facing <= 0) continue;
      const mean = [0, 1, 2].map(j => (c[0][j] + c[1][j] + c[2][j] + c[3][j]) / 4), all = c.map(a => a[2]);
      const plane = mean[2] - ((u[1] * v[2] - u[2] * v[1]) * (qx - mean[0]) + (u[2] * v[0] - u[0] * v[2]) * (qy - mean[1])) / facing;
      const z = Math.max(Math.min(...all), Math.min(Math.max(...all), plane));
      if (z > depth && normal[0] * qx + normal[1] * qy + normal[2] * z <= limit + 1e-4) { best = i; depth = z; }
    }
    return best;
  }
  listen() {
    const canvas = this.canvas, held = new Map();
    let moved = 0, spread = 0;
    const pan = (dx, dy) => { const [sx, sy] = this.scale(); this.shift[0] += 2 * dx / canvas.clientWidth / sx; this.shift[1] -= 2 * dy / canvas.clientHeight / sy; };
    const turn = (dx, dy) => { this.yaw += dx; this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + dy)); };
    const zoom = factor => { this.zoom = Math.max(0.2, Math.min(40, this.zoom * factor)); };
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); held.set(event.pointerId, [event.clientX, event.clientY]); moved = 0; spread = 0; });
    canvas.addEventListener("pointermove", event => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
      held.set(event.pointerId, [event.clientX, event.clientY]);
      moved += Math.abs(dx) + Math.abs(dy);
      if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (spread) zoom(now / spread);
        spread = now; pan(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons & 6) pan(dx, dy); else turn(0.008 * dx, 0.008 * dy);
      this.redraw();
    });
    const end = event => {
      held.delete(event.pointerId); spread = 0;
      if (event.type === "pointerup" && moved < 4 && this.onpick) { const box = canvas.getBoundingClientRect(); this.onpick(this.pick(event.clientX - box.left, event.clientY - box.top), event.shiftKey); }
    };
    canvas.addEventListener("pointerup", end); canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(-0.0015 * event.deltaY)); this.redraw(); }, { passive: false });
    canvas.addEventListener("keydown", event => {
      const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (arrow && event.shiftKey) pan(20 * arrow[0], 20 * arrow[1]);
      else if (arrow) turn(0.12 * arrow[0], 0.12 * arrow[1]);
      else if (event.key === "+" || event.key === "=") zoom(1.15);
      else if (event.key === "-") zoom(1 / 1.15);
      else if (event.key === "0") this.reset();
      else if (event.key === "Enter" && this.onpick) this.onpick(this.pick(canvas.clientWidth / 2, canvas.clientHeight / 2), event.shiftKey);
      else return;
      event.preventDefault(); this.redraw();
    });
  }
}
