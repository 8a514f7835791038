// Fills the page with the data of the run.
const data = JSON.parse(document.getElementById("data").textContent);
const element = id => document.getElementById(id);
const show = id => { element(id).hidden = false; };
// What the reader has chosen; kept when the page of a run in progress is loaded again.
const keeping = {}, kept = (() => {
  try { return data.reload ? JSON.parse(sessionStorage.getItem(location.pathname)) || {} : {}; } catch { return {}; }
})();
function texts() {
  element("title").textContent = data.title;
  element("summary").textContent = data.summary;
  data.notes.forEach(note => { show("notes"); element("notes").append(make("p", {}, note)); });
  data.warnings.forEach(({ message, help }) => {
    show("warnings");
    element("warnings-list").append(make("li", {}, message, ...help ? [make("span", { class: "help" }, help)] : []));
  });
  const r = data.results;
  if (r) {
    show("results");
    const { newest, path } = data.origin;
    if (path !== null && (r.quantities || r.contact)) {
      element("results-of").hidden = false;
      element("results-of").textContent = newest === path ? `All numbers are those of iteration ${path}.` : `Quantities and contact forces below are those of iteration ${path}.`;
    }
    if (r.rows.length) element("results-table").append(table([], r.rows, "words"));
    if (r.promise) {
      show("promise");
      element("promise-table").append(table(r.promise.columns, r.promise.rows, "wide"));
    }
    if (r.materials) {
      show("materials");
      element("materials-table").append(table(r.materials.columns, r.materials.rows, "wide"));
    }
    if (r.quantities) element("quantity-table").append(table(r.quantities.columns, r.quantities.rows, "wide"));
    if (r.contact) {
      element("contact-table").append(table(r.contact.columns, r.contact.rows, "wide"));
      element("results-help").textContent = "A resultant is the vector sum of all contact forces of a pair on the meshed part, friction included. A peak pressure is the value at a single node; at edges and corners it depends on the mesh. contact.csv lists all load steps.";
    }
  }
  element("units").textContent = `Units are those of the case file: lengths in${data.units[0]}, forces in${data.units[1]}, tractions in${data.units[2]}.`;
  element("case").textContent = data.case_text;
  element("resolved").textContent = JSON.stringify(data.resolved, null, 1);
  element("run").append(table([], data.run, "words"));
}
function curves() {
  const h = data.history, r = data.results;
  if (h && h.rows.length) {
    show("curves");
    const column = name => { const k = h.columns.indexOf(name); return k < 0 ? [] : h.rows.map(row => row[k]); };
    const x = column("iteration"), curve = (title, names, options = {}) => {
      const series = names.map(name => ({ name: name.replaceAll("_", " "), values: options.negated ? column(name).map(v => typeof v === "number" ? -v : v) : column(name) })).filter(s => s.values.length);
      const figure = chart(title, x, series, { pick: revealed("designs"), ...options });
      if (figure) element("history-charts").append(figure);
    };
    const functions = h.columns.filter(name => name !== "volume_fraction" && h.columns.includes(`multiplier_${name}`));
    const parts = functions.filter(name => name.startsWith("objective_"));
    const negated = Boolean(r && r.negated);
    curve(r ? r.title : "Objective θ (minimized)", parts.length ? parts : ["objective"], { negated });
    if (parts.length) curve("Shares of the largest:", parts.map(name => `multiplier_${name}`), { zero: true });
    if (r && r.objective) { element("objective-help").hidden = false; element("objective-help").textContent = `θ, which tables contain, is ${r.objective}${negated ? "; the chart shows −θ" : ""}.`; }
    const limit = data.volume_fraction;
    curve("Volume fraction", ["volume_fraction"], { bounds: limit === null ? [] : [{ value: limit, text: `≤ ${digits(limit)}` }] });
    const known = new Set(data.bounded.flatMap(of => bounded(of, h, column, x)));
    functions.filter(name => !parts.includes(name) && !known.has(name)).forEach(name => curve(`Constraint: ${name.replaceAll("_", " ")}`, [name]));
    if (column("violation").some(v => v > 0)) curve("Largest violation, relative to its bound", ["violation"], { zero: true });
    curve("Discreteness: 0 solid and void, 1 grey", ["discreteness"], { zero: true });
    curve("Largest change of a density", ["change"], { zero: true });
    curve("Newton iterations", ["newton_iterations"], { zero: true });
    if (column("uzawa_iterations").some(v => v > 0)) curve("Uzawa iterations", ["uzawa_iterations"], { zero: true });
    curve("Slave nodes at the end of the path:", ["open", "stick", "slip"], { zero: true });
    curve("Time [s]", ["seconds"], { zero: true });
    element("history-table").append(table(h.columns.map(name => name.replaceAll("_", " ")), h.rows));
  }
  const p = data.newton;
  if (p && p.step.length) {
    show("path");
    element("path-title").textContent += p.what;
    const cases = loadCases(data.quantities && data.quantities.rows);
    const put = figure => { if (figure) element("path-charts").append(figure); };
    put(chart(`Newton iterations${p.what}`, p.step, [{ name: "Newton iterations", values: p.iterations }], { bars: true, xname: "load step", parts: cases, pick: revealed("steps") }));
    put(chart("Slave nodes:", p.step, ["open", "stick", "slip"].map(name => ({ name, values: p[name] })), { zero: true, xname: "load step", parts: cases, pick: revealed("steps") }));
    if (p.failed.some(v => v > 0)) put(chart("Failed attempts", p.step, [{ name: "failed attempts", values: p.failed }], { bars: true, xname: "load step" }));
  }
  quantities();
  if (data.verify) {
    show("verify");
    element("verify-verdict").textContent = data.verify.verdict;
    element("verify-table").append(table(data.verify.columns, data.verify.rows));
  }
  if (data.evaluate) { show("evaluate"); element("evaluate-table").append(table(data.evaluate.columns.map(name => name.replaceAll("_", " ")), data.evaluate.rows)); }
}
// Colours of bodies and of marked surfaces, which can be told apart with any vision (Okabe and Ito, lightened).
const PALETTE = ["#9fb6c8", "#e0b07a", "#a8c99a", "#c9a7cf", "#d9cf8f", "#8fc9c4", "#d69a9a", "#b5b5b5", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#f0e442", "#56b4e9"];
// The design of the load path.
function pathOf() {
  return data.path_of || (data.origin.path === null ? "the newest design" : `the design of iteration ${data.origin.path}`);
}
// A chart of a bound: a line for each load case, of the worst step where there are several, and of the extreme itself
// where a smooth value is on the unsafe side. Returns the columns that it shows.
function bounded({ quantity, unit, bound, least, cases }, h, column, x) {
  const shown = cases.flatMap(([, names]) => names).filter(name => h.columns.includes(name));
  if (!shown.length) return [];
  const worst = names => x.map((_, i) => { const all = names.map(name => column(name)[i]).filter(v => typeof v === "number"); return all.length ? (least ? Math.min(...all) : Math.max(...all)) : null; });
  const extremes = names => names.map(name => `${name}_extreme`).filter(name => h.columns.includes(name)), title = quantity.replaceAll("_", " ");
  const [single, several] = [cases.length === 1, cases.some(([, names]) => names.length > 1)];
  const series = cases.map(([name, names]) => ({ name: single ? title : name, values: worst(single ? names : [...names, ...extremes(names)]) }));
  if (single && extremes(shown).length) series.push({ name: "the extreme itself", values: worst(extremes(shown)) });
  const figure = chart(`Constraint${series.length > 1 && single ? "" : `: ${title}`} ${bound.text}${unit}${several ? ", worst load step" : ""}`, x, series, { bounds: [bound] });
  if (figure) element("history-charts").append(figure);
  return shown;
}
// Names of the load cases, and the load step before each.
function loadCases(rows) {
  const q = data.quantities;
  if (!rows || !data.load_cases.length) return [];
  const [step, number] = ["step", "load_case"].map(name => q.columns.indexOf(name));
  return data.load_cases.map((name, k) => ({ name, from: Math.min(...rows.filter(row => row[number] === k).map(row => row[step])) })).filter(part => Number.isFinite(part.from)).map((part, k) => k ? { ...part, from: part.from - 0.5 } : part);
}
// Any quantity over any other, at the load steps of the newest design.
function quantities() {
  const q = data.quantities;
  if (!q || q.rows.length < 2) return;
  show("quantities");
  element("quantities-help").textContent = `At each load step of ${pathOf()}, with a line for each load case and, after evaluate, each coefficient of friction, and dashed lines for bounds; units and meanings are those of quantities.csv. Choose what to plot against what.`;
  const names = q.columns.filter(name => name !== "load_case" && name !== "friction"), pick = (label, chosen) => {
    const select = make("select", { "aria-label": label }, ...names.map(name => make("option", { value: name }, name.replaceAll("_", " "))));
    select.value = chosen;
    element("quantities-controls").append(make("label", {}, `${label} `, select), " ");
    return select;
  };
  const [x, y] = data.curve || ["time", names[names.length - 1]];
  const known = ([x, y]) => names.includes(x) && names.includes(y), chosen = kept.curve && known(kept.curve) ? kept.curve : [x, y];
  const across = pick("x", chosen[0]), up = pick("y", chosen[1]), at = (row, name) => row[q.columns.indexOf(name)];
  const column = (name, rows = q.rows) => rows.map(row => at(row, name)), named = row => [q.columns.includes("friction") ? `friction ${digits(at(row, "friction"))}` : "", data.load_cases[at(row, "load_case")] || ""].filter(text => text).join(", ");
  const paths = q.rows.map(named), own = name => data.named.find(of => of.name === name) || { name, unit: "", bounds: [] };
  // evaluations with several coefficients of friction repeat the steps
  const newest = q.rows.filter(row => at(row, "friction") === at(q.rows[q.rows.length - 1], "friction"));
  const draw = () => {
    const title = name => name.replaceAll("_", " ") + own(name).unit, parts = loadCases(newest);
    const figure = curve(title(up.value), column(across.value), column(up.value), across.value.replaceAll("_", " "), paths, own(up.value).bounds, i => revealed("steps")(at(q.rows[i], "step")));
    const others = q.columns.includes("external_work") ? chart("Energy:", column("step", newest), ["external_work", "strain_energy", "friction_work"].map(name => ({ name: name.replaceAll("_", " "), values: column(name, newest) })), { zero: true, xname: "load step", parts }) : null;
    const each = data.named.map(of => chart(title(of.name), column("step", newest), [{ name: of.name, values: column(of.name, newest) }], { xname: "load step", bounds: of.bounds, parts, pick: revealed("steps") }));
    element("quantities-charts").replaceChildren(...[figure, others, ...each].filter(f => f));
  };
  keeping.curve = () => [across.value, up.value];
  [across, up].forEach(select => select.addEventListener("change", draw));
  draw();
}
function view() {
  const m = data.model, viewer = new Viewer(element("canvas"));
  const points = new Float32Array(bytesOf(m.points).buffer), hexes = new Uint32Array(bytesOf(m.hexes).buffer);
  const quads = new Uint32Array(bytesOf(m.quads).buffer), slaves = new Uint32Array(bytesOf(m.slaves).buffer);
  const faces = facesOf(hexes, points.length / 3), nodeCount = points.length / 3;
  const bodyOfHex = new Uint8Array(hexes.length / 8), bodyOfQuad = new Uint8Array(quads.length / 4);
  m.bodies.forEach((body, b) => { bodyOfHex.fill(b, ...body.hexes); bodyOfQuad.fill(b, ...body.quads); });
  const designs = data.designs, steps = data.steps;
  const state = { mode: steps.length && !designs.length ? "steps" : "designs", design: designs.length - 1, step: steps.length - 1, threshold: 0.5, scale: 1, field: "density", smooth: true, hidden: new Set(), section: null };
  const designed = m.bodies.some(body => body.designed);
  if (!designs.length && steps.length) state.mode = "steps"; else if (steps.length) state.mode = "steps";
  if (kept.state) {
    const { atLast, hidden, ...rest } = kept.state;
    const counts = { design: designs.length, step: steps.length }, last = name => atLast[name] || rest[name] >= counts[name] ? counts[name] - 1 : rest[name];
    Object.assign(state, rest, { design: last("design"), step: last("step"), hidden: new Set(hidden), mode: steps.length && (rest.mode === "steps" || !designs.length) ? "steps" : "designs" });
  }
  keeping.state = () => ({ ...state, hidden: [...state.hidden], atLast: { design: state.design === designs.length - 1, step: state.step === steps.length - 1 } });
  const cache = new Map(), open = packed => { if (!cache.has(packed)) cache.set(packed, unpacked(packed)); return cache.get(packed); };
  const frame = () => state.mode === "steps" ? steps[state.step] : designs[state.design];
  const density = () => state.mode === "steps" ? m.path_density : frame().density;
  // An initial design is shown whole: most elements below the threshold have the same density, which is not that of void.
  if (density()) {
    const below = open(density()).filter((phi, e) => phi <= state.threshold && m.bodies[bodyOfHex[e]].designed).sort(), middle = below[below.length >> 1];
    if (!designed || middle > 0.05 && below.filter(phi => Math.abs(phi - middle) < 0.02).length > 0.5 * below.length) state.threshold = 0;
  }
  if (data.setup) Object.assign(state, { field: "body", threshold: 0, smooth: false });
  const units = { body: "", density: "", derivative: data.units[1], displacement: data.units[0], pressure: data.units[2], gap: data.units[0], slip: data.units[0], status: "", stress: data.units[2], plastic: "" };
  const names = { body: "bodies", density: "density", derivative: "dθ/dφ of the objective", displacement: "magnitude of the displacement", pressure: "contact pressure", gap: "contact gap", slip: "slip increment", status: "contact status", stress: "von Mises stress", plastic: "equivalent plastic strain" };
  const available = () => state.mode === "steps" ? ["density", "displacement", "stress", "plastic", "pressure", "status", "gap", "slip", "body"].filter(f => f === "body" || (f === "density" ? designed : f === "status" ? frame().status : frame()[f])) : ["density", "derivative", "body"].filter(f => f === "body" || frame()[f]);
  function nodal(field) {
    const f = frame(), values = new Float32Array(nodeCount).fill(NaN);
    if (field === "displacement") { const u = open(f.displacement); for (let n = 0; n < nodeCount; n++) values[n] = Math.hypot(u[3 * n], u[3 * n + 1], u[3 * n + 2]); return values; }
    const source = field === "status" ? bytesOf(f.status) : open(f[field]);
    slaves.forEach((n, i) => { values[n] = source[i]; });
    return values;
  }
  // One colour scale for all load steps, so that steps can be compared.
  const ranges = new Map();
  // Another view has the same scale if the containing page compares both.
  const range = field => common && common.field === field ? common.range : ownRange(field);
  function ownRange(field) {
    if (field === "density" || field === "body") return [0, 1];
    if (field === "status") return [0, 2];
    if (everywhere(field)) return ofMaterial(field);
    const key = `${state.mode} ${field}`;
    if (!ranges.has(key)) {
      let low = field === "derivative" || field === "gap" ? Infinity : 0, high = -Infinity;
      (state.mode === "steps" ? steps : designs).forEach(f => {
        if (!f[field]) return;
        const v = open(f[field]), size = field === "displacement" ? 3 : 1;
        for (let i = 0; i < v.length; i += size) { const s = size === 3 ? Math.hypot(v[i], v[i + 1], v[i + 2]) : v[i]; low = Math.min(low, s); high = Math.max(high, s); }
      });
      ranges.set(key, high > low ? [low, high] : [low, low + 1]);
    }
    return ranges.get(key);
  }
  // Fields of the material of all bodies.
  const everywhere = field => field === "stress" || field === "plastic";
  // Of what is shown: void has no stress, and that of a hidden body does not matter.
  const counts = (i, phi) => i < hexes.length / 8 ? (!phi || phi[i] > state.threshold) && !state.hidden.has(bodyOfHex[i]) : !state.hidden.has(bodyOfQuad[i - hexes.length / 8]);
  function ofMaterial(field) {
    const key = `${field} ${state.threshold} ${[...state.hidden].sort().join()}`;
    if (!ranges.has(key)) {
      const phi = density() && open(density());
      let high = 0;
      steps.forEach(f => { if (f[field]) open(f[field]).forEach((v, i) => { if (v > high && counts(i, phi)) high = v; }); });
      ranges.set(key, [0, high || 1]);
    }
    return ranges.get(key);
  }
  // Without a designed body, or with full material everywhere, the density would be a single colour.
  if (state.mode === "steps" && (!designed || open(density()).every(phi => phi === 1))) {
    state.field = "displacement";
    if (!designed) element("view-title").textContent = "Bodies";
  }
  // Without material that is left out, there is nothing to round, and the colours show the densities.
  const smooth = () => designed && state.smooth && state.threshold > 0;
  // Colours of bodies and marks are values below -2.
  const coloured = k => -3 - k, ofBody = b => b % 8, ofMark = k => 8 + k % 6;
  const keyOf = corners => [...new Set(corners)].sort((a, b) => a - b).join();
  let marking = [], marks = null, following = false, picks = null, common = null;
  // The colours of faces that the containing page marks.
  function faces_marked() {
    if (marks) return marks;
    marks = new Map();
    for (const [name, colour] of marking) {
      const mark = (data.marks || []).find(of => of.name === name);
      if (!mark) continue;
      const quads4 = mark.quads && new Uint32Array(bytesOf(mark.quads).buffer), set = mark.points && new Set(new Uint32Array(bytesOf(mark.points).buffer));
      if (quads4) for (let i = 0; i < quads4.length; i += 4) marks.set(keyOf([...quads4.subarray(i, i + 4)]), colour);
      else for (const list of [faces.nodes, quads]) for (let i = 0; i < list.length; i += 4) if ([0, 1, 2, 3].every(k => set.has(list[i + k]))) marks.set(keyOf([...list.subarray(i, i + 4)]), colour);
    }
    return marks;
  }
  // What the containing page asks for: marked surfaces, a direction of view, a state of the run.
  addEventListener("message", ({ data: asked, source }) => {
    if (!asked || !framed || source !== parent) return;
    if (Array.isArray(asked.mark)) {
      marking = asked.mark; marks = null;
      if (marking.length && available().includes("body")) state.field = "body";
      refresh();
    }
    if (asked.camera) { following = true; Object.assign(viewer, asked.camera); viewer.draw(); following = false; }
    if (asked.show) { following = Boolean(asked.show.quiet); reveal(asked.show.mode, asked.show.number, asked.show); following = false; tellState(); }
    if (asked.range) { common = asked.range; refresh(); }
  });
  let rest = { key: null, points };
  function positions(solid) {
    const phi = density(), key = smooth() ? [state.threshold, [...state.hidden].sort(), phi && phi.data].join() : null;
    if (rest.key !== key) rest = { key, points: key === null ? points : smoothed(points, faces, solid) };
    if (state.mode !== "steps" || state.scale === 0 || !frame().displacement) return rest.points;
    const u = open(frame().displacement);
    return rest.points.map((x, i) => x + state.scale * u[i]);
  }
  let reported = "";
  function tellState() {
    if (!framed || following || data.setup) return;
    const told = { mode: state.mode, number: frame() ? frame().number : null, field: state.field, range: ownRange(state.field) }, text = JSON.stringify(told);
    if (text !== reported) { reported = text; parent.postMessage({ state: told }, "*"); }
  }
  function refresh() {
    tellState();
    const phi = density() ? open(density()) : new Float32Array(hexes.length / 8).fill(1), solid = e => e >= 0 && phi[e] > state.threshold && !state.hidden.has(bodyOfHex[e]);
    const whole = everywhere(state.field), bodies = state.field === "body", cells = whole || ["density", "derivative", "body"].includes(state.field), [low, high] = range(state.field);
    const count = hexes.length / 8;
    let values = bodies ? bodyOfHex : cells ? open(state.field === "density" ? density() : frame()[state.field]) : nodal(state.field);
    const unit = v => Number.isNaN(v) ? -1 : Math.max(0, Math.min(1, (v - low) / (high - low)));
    const material = smooth() && state.field === "density";
    const ofElement = e => bodies ? coloured(ofBody(bodyOfHex[e])) : material && m.bodies[bodyOfHex[e]].designed ? -2 : whole || m.bodies[bodyOfHex[e]].designed ? unit(values[e]) : -1;
    const nodes = [], shown = [], owners = [], inner = new Set(), marked = faces_marked();
    const emphasize = () => { if (marked.size) { const k = marked.get(keyOf(nodes.slice(-4))); if (k !== undefined) shown.fill(coloured(ofMark(k)), -4); } };
    let at = positions(solid);
    for (let f = 0; f < faces.sides.length / 2; f++) {
      const [a, b] = [faces.sides[2 * f], faces.sides[2 * f + 1]];
      if (solid(a) === solid(b)) continue;
      const owner = solid(a) ? a : b;
      for (let k = 0; k < 4; k++) { const n = faces.nodes[4 * f + (owner === a ? k : 3 - k)]; nodes.push(n); shown.push(cells ? ofElement(owner) : unit(values[n])); }
      emphasize();
      owners.push(owner);
    }
    for (let q = 0; q < quads.length / 4; q++) {
      if (state.hidden.has(bodyOfQuad[q])) continue;
      for (let k = 0; k < 4; k++) { const n = quads[4 * q + k]; nodes.push(n); shown.push(bodies ? coloured(ofBody(bodyOfQuad[q])) : cells ? (whole ? unit(values[count + q]) : -1) : unit(values[n])); }
      emphasize();
      owners.push(whole ? count + q : -1);
    }
    if (state.section) {
      const cut = sectionOf(hexes, at, solid, state.section), between = k => values[cut.ends[2 * k]] + cut.parts[k] * (values[cut.ends[2 * k + 1]] - values[cut.ends[2 * k]]);
      for (const [e, polygon] of cut.polygons) for (const [corners, quiet] of filled(polygon)) {
        if (quiet) inner.add(owners.length);
        // a status has no values in between
        for (const k of corners) { nodes.push(nodeCount + k); shown.push(cells ? ofElement(e) : state.field === "status" ? -1 : unit(between(k))); }
        owners.push(e);
      }
      at = joined(at, cut.coordinates);
      if (!cells) values = joined(values, cut.parts.map((_, k) => state.field === "status" ? NaN : between(k)));
    }
    viewer.categories = state.field === "status";
    // Faces with a corner without a value have no colour.
    for (let i = 0; i < shown.length; i += 4) if (shown.slice(i, i + 4).some(v => v === -1)) shown.fill(-1, i, i + 4);
    viewer.values = { raw: values, cells };
    viewer.show(at, Uint32Array.from(nodes), shown, owners, state.section, inner, smooth());
    legend(low, high, owners.length, material);
  }
  function legend(low, high, count, material) {
    const box = element("legend"), name = names[state.field] + units[state.field];
    box.replaceChildren();
    if (state.field === "body") {
      m.bodies.forEach((body, b) => { if (!state.hidden.has(b)) box.append(make("div", {}, make("span", { class: "key", style: `background:${PALETTE[ofBody(b)]}` }), body.name)); });
      marking.filter(([name]) => (data.marks || []).some(of => of.name === name)).forEach(([name, k]) => box.append(make("div", {}, make("span", { class: "key", style: `background:${PALETTE[ofMark(k)]}` }), `surface ${name}`)));
    } else if (material) {
      box.append(`material where the density is above ${state.threshold}, its surface rounded`);
    } else if (state.field === "status") {
      box.append(name);
      [["open", "#9ea8b3"], ["stick", "#2166ab"], ["slip", "#d6611a"]].forEach(([word, colour]) => box.append(make("span", { class: "key", style: `background:${colour}` }), word));
    } else {
      const stops = ["#440154", "#414487", "#2a788e", "#22a884", "#7ad151", "#fde725"];
      box.append(name, make("div", { class: "bar", style: `background: linear-gradient(to right, ${stops.join(",")})` }), make("div", { class: "ends" }, make("span", {}, digits(low)), make("span", {}, digits(high))));
    }
    if (common && common.field === state.field && !material) box.append(make("div", {}, "the scale is that of both runs"));
    if (everywhere(state.field)) box.append(make("div", {}, largest()));
    // an early design may have no material, although other bodies are shown
    const phi = designed && state.threshold > 0 && density() && open(density());
    if (phi && !phi.some((v, e) => v > state.threshold && m.bodies[bodyOfHex[e]].designed)) count = 0;
    if (count === 0) box.append(make("div", {}, `no density above ${state.threshold}`));
  }
  const numbered = e => `element ${m.elements[bodyOfHex[e]] + e - m.bodies[bodyOfHex[e]].hexes[0]}`;
  // The largest value of what is shown, in this step, and its place.
  function largest() {
    const values = open(frame()[state.field]), count = hexes.length / 8, phi = density() && open(density());
    let top = -1;
    values.forEach((v, i) => { if (top < 0 || v > values[top]) if (counts(i, phi)) top = i; });
    if (top < 0) return "";
    return `at this step up to ${digits(values[top])}, ${top < count ? `${numbered(top)} of ${m.bodies[bodyOfHex[top]].name}` : m.bodies[bodyOfQuad[top - count]].name}`;
  }
  viewer.onpick = (face, shift) => {
    if (picks && picks.click(face, shift)) return;
    const probe = element("probe");
    if (face < 0) { probe.textContent = ""; return; }
    const nodes = [...viewer.shown.nodes.slice(4 * face, 4 * face + 4)], owner = viewer.shown.owners[face], { raw, cells } = viewer.values;
    const where = owner >= 0 && owner < hexes.length / 8 ? numbered(owner) : "";
    if (state.field === "body") { probe.textContent = owner >= 0 ? `${where} of ${m.bodies[bodyOfHex[owner]].name}` : ""; return; }
    const value = cells ? (owner >= 0 ? digits(raw[owner]) : "no value here") : nodes.map(n => raw[n]).some(Number.isNaN) ? "no value here" : `${digits(Math.min(...nodes.map(n => raw[n])))} to ${digits(Math.max(...nodes.map(n => raw[n])))} at the corners`;
    probe.textContent = `${where ? where + ", " : ""}${names[state.field]}: ${value}`;
  };
  if (!available().includes(state.field)) state.field = available()[0];
  viewer.palette = PALETTE;
  viewer.frame(points);
  const controlled = controls({ m, state, designs, steps, available, names, refresh, viewer, designed: designed && !data.setup, box: viewer.box });
  // Shows the state of an iteration (`designs`) or a load step (`steps`), or the nearest one that the page has.
  reveal = (mode, number, { quiet = false, field = "" } = {}) => {
    const all = mode === "steps" ? steps : designs;
    if (!all.length) { if (framed) parent.postMessage({ revealed: { mode, number, found: null } }, "*"); return; }
    let best = 0;
    all.forEach((of, i) => { if (Math.abs(of.number - number) < Math.abs(all[best].number - number)) best = i; });
    controlled.to(mode, best, field);
    refresh();
    if (quiet) return;
    element("view").scrollIntoView({ block: "start" });
    if (framed) parent.postMessage({ revealed: { mode, number, found: all[best].number } }, "*");
  };
  if (data.setup && framed) picks = picking(viewer, points);
  if (framed) viewer.onturn = () => { if (!following) parent.postMessage({ camera: keeping.camera() }, "*"); };
  Object.assign(viewer, kept.camera);
  keeping.camera = () => ({ yaw: viewer.yaw, pitch: viewer.pitch, zoom: viewer.zoom, shift: viewer.shift });
  refresh();
}
// Shows a state of the run in the view, if there is one.
let reveal = null;
const revealed = mode => number => { if (reveal) reveal(mode, number); };
// While the run is in progress, the program writes this file again; the view stays as it is.
function follow() {
  let busy = false;
  addEventListener("pointerdown", () => { busy = true; });
  addEventListener("pointerup", () => { busy = false; });
  if (kept.scroll) scrollTo(0, kept.scroll);
  setInterval(() => {
    if (busy || document.hidden || document.querySelector(".playing")) return;
    const choices = Object.fromEntries(Object.entries(keeping).map(([name, value]) => [name, value()]));
    try { sessionStorage.setItem(location.pathname, JSON.stringify({ ...choices, scroll: scrollY })); } catch { /* without storage, choices are lost */ }
    location.reload();
  }, 1000 * data.reload);
}
texts();
curves();
const flat = why => { document.querySelector(".stage").classList.add("flat"); if (!element("picture").getAttribute("src")) { element("view").hidden = !data.model; element("picture").remove(); } element("probe").textContent = why; };
if (!data.model) flat(""); else try { view(); } catch (error) { flat(`The interactive view is not available here (${error.message}).`); }
document.documentElement.dataset.ready = data.model && !document.querySelector(".flat") ? "view" : "flat";
if (data.reload) follow();
