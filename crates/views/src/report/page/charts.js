// Curves as SVG, tables, and small helpers for both.
function make(name, attributes, ...children) {
  const svg = ["svg", "g", "line", "path", "circle", "rect", "text", "title"].includes(name);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) node.setAttribute(key, value);
  node.append(...children);
  return node;
}
function digits(value, count = 4) {
  if (value === null || value === undefined) return "";
  if (typeof value !== "number") return String(value);
  const size = Math.abs(value);
  if (Number.isInteger(value) && size < 1e7) return String(value);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(count - 1) : String(+value.toPrecision(count + 1));
}
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw);
  const all = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) all.push(k * step);
  return all;
}
// Bounds [{ value, text }] that a chart of values from `low` to `high` shows as lines, which may extend the range to
// five times its size; the others are only named.
function boundsNear(bounds, low, high) {
  const size = Math.max(high - low, 0.1 * Math.max(Math.abs(low), Math.abs(high)));
  return bounds.filter(({ value }) => size === 0 || Math.max(high, value) - Math.min(low, value) <= 5 * size);
}
function boundLines(svg, bounds, [left, right], py) {
  for (const { value, text } of bounds) {
    svg.append(make("line", { class: "bound", x1: left, x2: right, y1: py(value), y2: py(value) }));
    svg.append(make("text", { class: "bound", x: right - 2, y: py(value) - 3, "text-anchor": "end" }, text));
  }
}
const boundWords = (all, near) => all.length ? `, bound ${all.map(b => near.includes(b) ? b.text : `${b.text} (off the chart)`).join(", ")}` : "";
// series: [{ name, values }]; x: their abscissae; `bars` draws columns from zero. `parts` are ranges of x with names:
// [{ name, from }].
function chart(title, x, series, { bars = false, zero = false, xname = "iteration", bounds = [], parts = [], pick = null } = {}) {
  const shown = series.filter(s => s.values.some(v => v !== null));
  if (x.length === 0 || shown.length === 0) return null;
  const [width, height, left, right, top, bottom] = [420, 210, 56, 10, parts.length ? 22 : 10, 30];
  const values = shown.flatMap(s => s.values.filter(v => v !== null));
  let low = Math.min(...values), high = Math.max(...values);
  const near = boundsNear(bounds, low, high);
  low = Math.min(low, ...near.map(b => b.value)); high = Math.max(high, ...near.map(b => b.value));
  if (zero || bars) { low = Math.min(low, 0); high = Math.max(high, 0); }
  if (high - low < 1e-12 * Math.max(Math.abs(low), Math.abs(high), 1e-300)) { const pad = Math.abs(high) * 0.1 || 1; low -= pad; high += pad; }
  const pad = (high - low) * 0.05;
  if (!(low === 0 && (zero || bars))) low -= pad;
  high += pad;
  const half = bars ? 0.5 : 0, [first, last] = [x[0] - half, x[x.length - 1] + half];
  const px = v => left + (width - left - right) * (last > first ? (v - first) / (last - first) : 0.5);
  const py = v => height - bottom - (height - top - bottom) * (v - low) / (high - low);
  const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "img" });
  const spoken = shown.map(s => `${s.name} from ${digits(s.values[0])} to ${digits(s.values[s.values.length - 1])}`).join("; ");
  svg.setAttribute("aria-label", `${title}: ${spoken}${boundWords(bounds, near)}`);
  for (const t of ticks(low, high, 4)) {
    svg.append(make("line", { class: "axis", x1: left, x2: width - right, y1: py(t), y2: py(t) }));
    svg.append(make("text", { x: left - 6, y: py(t) + 4, "text-anchor": "end" }, digits(t, 3)));
  }
  for (const t of ticks(x[0], Math.max(x[x.length - 1], x[0] + 1), 6).filter(t => Number.isInteger(t) && t <= last)) {
    svg.append(make("text", { x: px(t), y: height - bottom + 15, "text-anchor": "middle" }, digits(t)));
  }
  svg.append(make("text", { x: width - right, y: height - 2, "text-anchor": "end" }, xname));
  parts.forEach(({ name, from }, k) => {
    if (k) svg.append(make("line", { class: "axis", x1: px(from), x2: px(from), y1: top - 12, y2: height - bottom }));
    svg.append(make("text", { x: px(Math.max(from, first)) + 3, y: top - 6 }, name));
  });
  boundLines(svg, near, [left, width - right], py);
  shown.forEach((s, k) => {
    const colour = `var(--c${k % 3})`;
    if (bars) {
      const wide = Math.max(1, 0.8 * (px(first + 1) - px(first)) / shown.length);
      s.values.forEach((v, i) => { if (v !== null) svg.append(make("rect", { x: px(x[i]) - wide * shown.length / 2 + k * wide, y: py(Math.max(v, 0)), width: wide, height: Math.abs(py(0) - py(v)), fill: colour })); });
      return;
    }
    let d = "", pen = "M";
    s.values.forEach((v, i) => { if (parts.some(({ from }) => i && x[i - 1] < from && x[i] > from)) pen = "M"; if (v === null) { pen = "M"; } else { d += `${pen}${px(x[i]).toFixed(1)} ${py(v).toFixed(1)}`; pen = "L"; } });
    svg.append(make("path", { d, fill: "none", stroke: colour, "stroke-width": 1.8, "stroke-linejoin": "round", "stroke-dasharray": DASHES[Math.floor(k / 3) % 3] }));
    if (x.length <= 40) s.values.forEach((v, i) => { if (v !== null) svg.append(make("circle", { cx: px(x[i]), cy: py(v), r: 2.4, fill: colour })); });
  });
  const far = bounds.filter(b => !near.includes(b)), caption = make("span", {}, title.replace(/:$/, "") + boundWords(far, []) + (shown.length > 1 ? ":" : "")), at = make("span", { class: "at" });
  if (shown.length > 1) shown.forEach((s, k) => caption.append(" ", make("span", { style: `color: var(--c${k % 3})` }, s.name)));
  const cursor = make("line", { class: "cursor", y1: top, y2: height - bottom, visibility: "hidden" });
  svg.append(cursor);
  const tell = i => {
    at.textContent = `${xname} ${digits(x[i])}: ${shown.map(s => digits(s.values[i])).join(", ")}`;
    cursor.setAttribute("x1", px(x[i])); cursor.setAttribute("x2", px(x[i])); cursor.setAttribute("visibility", "visible");
  };
  const nearest = event => {
    const box = svg.getBoundingClientRect(), where = (event.clientX - box.left) / box.width * width;
    let near = 0;
    x.forEach((v, i) => { if (Math.abs(px(v) - where) < Math.abs(px(x[near]) - where)) near = i; });
    return near;
  };
  svg.addEventListener("pointermove", event => tell(nearest(event)));
  if (pick) choosable(svg, x.length, i => { tell(i); return `${xname} ${digits(x[i])}`; }, i => pick(x[i]), nearest);
  svg.addEventListener("pointerleave", () => { at.textContent = ""; cursor.setAttribute("visibility", "hidden"); });
  return make("figure", {}, make("figcaption", {}, caption, at), svg);
}
// A curve whose points can be chosen: by a click, or by the arrow keys and Enter. `tell` shows a point and names it.
function choosable(svg, count, tell, choose, nearest) {
  let at = count - 1;
  svg.setAttribute("tabindex", "0");
  svg.classList.add("choosable");
  svg.append(make("title", {}, "Click, or press the arrow keys and Enter, to show this state in the view"));
  svg.addEventListener("click", event => { const near = nearest(event); if (near !== null) { at = near; choose(at); } });
  svg.addEventListener("focus", () => tell(at));
  svg.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1, Home: -count, End: count }[event.key];
    if (step) { at = Math.max(0, Math.min(count - 1, at + step)); tell(at); } else if (event.key === "Enter") choose(at); else return;
    event.preventDefault();
  });
}
const DASHES = ["", "7 3", "2 3"];
// One quantity over another, which need not be ascending: a line for each run of equal `paths`, the names of lines.
function curve(title, x, y, xname, paths, bounds = [], pick = null) {
  const points = x.map((v, i) => [v, y[i], paths[i], i]).filter(([a, b]) => a !== null && b !== null);
  if (points.length < 2) return null;
  const [width, height, left, right, top, bottom] = [420, 210, 56, 14, 10, 30];
  const range = values => {
    let low = Math.min(...values), high = Math.max(...values);
    if (high - low < 1e-12 * Math.max(Math.abs(low), Math.abs(high), 1e-300)) { const pad = Math.abs(high) * 0.1 || 1; low -= pad; high += pad; }
    const pad = (high - low) * 0.05;
    return [low - pad, high + pad];
  };
  const up = points.map(p => p[1]), near = boundsNear(bounds, Math.min(...up), Math.max(...up)), far = bounds.filter(b => !near.includes(b));
  const [x0, x1] = range(points.map(p => p[0])), [y0, y1] = range([...up, ...near.map(b => b.value)]);
  const px = v => left + (width - left - right) * (v - x0) / (x1 - x0), py = v => height - bottom - (height - top - bottom) * (v - y0) / (y1 - y0);
  const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${title} over ${xname}, ${points.length} points${boundWords(bounds, near)}` });
  for (const t of ticks(y0, y1, 4).filter(t => t >= y0 && t <= y1)) {
    svg.append(make("line", { class: "axis", x1: left, x2: width - right, y1: py(t), y2: py(t) }));
    svg.append(make("text", { x: left - 6, y: py(t) + 4, "text-anchor": "end" }, digits(t, 3)));
  }
  for (const t of ticks(x0, x1, 5).filter(t => t >= x0 && t <= x1)) svg.append(make("text", { x: px(t), y: height - bottom + 15, "text-anchor": "middle" }, digits(t, 3)));
  svg.append(make("text", { x: width - right, y: height - 2, "text-anchor": "end" }, xname));
  boundLines(svg, near, [left, width - right], py);
  const at = make("span", { class: "at" }), caption = make("span", {}, title + boundWords(far, [])), named = [...new Set(points.map(p => p[2]))];
  const say = ([a, b, name]) => { at.textContent = `${name ? `${name}, ` : ""}${xname} ${digits(a)}: ${digits(b)}`; };
  named.forEach((name, k) => {
    const own = points.filter(p => p[2] === name), colour = `var(--c${k % 3})`, dash = DASHES[Math.floor(k / 3) % 3];
    const d = own.map(([a, b], i) => `${i ? "L" : "M"}${px(a).toFixed(1)} ${py(b).toFixed(1)}`).join("");
    svg.append(make("path", { d, fill: "none", stroke: colour, "stroke-width": 1.8, "stroke-linejoin": "round", "stroke-dasharray": dash }));
    own.forEach(([a, b]) => {
      const dot = make("circle", { cx: px(a), cy: py(b), r: 3, fill: colour });
      dot.addEventListener("pointerenter", () => say([a, b, name]));
      svg.append(dot);
    });
    if (named.length === 1 && !name) return;
    const sample = make("svg", { viewBox: "0 0 18 8", class: "sample", "aria-hidden": "true" });
    sample.append(make("line", { x1: 0, x2: 18, y1: 5, y2: 5, stroke: colour, "stroke-width": 2, "stroke-dasharray": dash }));
    caption.append(" ", sample, make("span", { style: `color: ${colour}` }, name));
  });
  if (pick) {
    const ring = make("circle", { class: "cursor", r: 6, fill: "none", visibility: "hidden" });
    svg.append(ring);
    const tell = i => { say(points[i]); ring.setAttribute("cx", px(points[i][0])); ring.setAttribute("cy", py(points[i][1])); ring.setAttribute("visibility", "visible"); };
    const nearest = event => {
      const box = svg.getBoundingClientRect(), [u, v] = [(event.clientX - box.left) / box.width * width, (event.clientY - box.top) / box.height * height];
      const far = points.map(([a, b]) => Math.hypot(px(a) - u, py(b) - v)), least = far.indexOf(Math.min(...far));
      return far[least] < 20 ? least : null;
    };
    choosable(svg, points.length, tell, i => { tell(i); pick(points[i][3]); }, nearest);
  }
  return make("figure", {}, make("figcaption", {}, caption, at), svg);
}
function table(columns, rows, kind = "") {
  const body = rows.map(row => make("tr", {}, ...row.map(cell => make("td", {}, digits(cell, 5)))));
  const head = columns.length ? [make("thead", {}, make("tr", {}, ...columns.map(name => make("th", {}, name))))] : [];
  return make("table", { class: kind }, ...head, make("tbody", {}, ...body));
}
