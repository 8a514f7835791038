// Faces that are picked to get a name, in a page that contains this one: a click selects the smooth face under it, Shift
// adds or removes one.
const framed = parent !== window;
function picking(viewer, points) {
  const form = element("controls"), picked = new Map(), count = points.length / 3;
  let on = false, degrees = 30, links = { shown: null, edges: null };
  const cornersOf = f => [0, 1, 2, 3].map(k => viewer.shown.nodes[4 * f + k]), key = corners => [...new Set(corners)].sort((a, b) => a - b).join();
  const distinct = corners => corners.filter((n, k) => n !== corners[(k + 1) % 4]);
  const edgesOf = corners => { const c = distinct(corners); return c.map((a, k) => { const b = c[(k + 1) % c.length]; return Math.min(a, b) * count + Math.max(a, b); }); };
  const normal = corners => {
    const p = corners.map(n => points.subarray(3 * n, 3 * n + 3)), [u, w] = [0, 1].map(k => [0, 1, 2].map(j => p[k + 2][j] - p[k][j]));
    return [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
  };
  const angle = (a, b) => {
    const cross = Math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
    return Math.atan2(cross, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 180 / Math.PI;
  };
  // Faces of a section have other points.
  const isFace = f => cornersOf(f).every(n => n < count);
  function neighbours() {
    if (links.shown === viewer.shown.nodes) return links.edges;
    const edges = new Map();
    for (let f = 0; f < viewer.shown.nodes.length / 4; f++) if (isFace(f)) for (const edge of edgesOf(cornersOf(f))) { const known = edges.get(edge); if (known) known.push(f); else edges.set(edge, [f]); }
    links = { shown: viewer.shown.nodes, edges };
    return edges;
  }
  function smoothFace(start) {
    const edges = neighbours(), reached = new Set([start]), open = [start];
    while (open.length) {
      const f = open.pop(), n = normal(cornersOf(f));
      for (const other of edgesOf(cornersOf(f)).flatMap(edge => edges.get(edge))) if (!reached.has(other) && angle(n, normal(cornersOf(other))) <= degrees) { reached.add(other); open.push(other); }
    }
    return [...reached].map(f => { const corners = cornersOf(f); return [key(corners), corners]; });
  }
  function changed() {
    viewer.over([...picked.values()], points);
    parent.postMessage({ picked: [...picked.values()].flat(), degrees }, "*");
  }
  const clear = () => { picked.clear(); changed(); };
  const set = make("fieldset", { class: "picking" }), box = make("input", { type: "checkbox" }), value = make("span", { class: "value" }, "30°");
  const turn = make("input", { type: "range", min: 0, max: 89, step: 1, value: degrees, "aria-valuetext": "30°" }), button = make("button", { type: "button" }, "Clear the picked faces");
  const slider = make("label", {}, "Edges end a face beyond", value, turn), help = make("p", { class: "quiet" }, "Click on a face, or press Enter for the face at the cross; with Shift, add or remove it. Picked faces behind others are outlined.");
  const apply = () => { [slider, button, help].forEach(part => { part.hidden = !on; }); viewer.aim(on); };
  box.addEventListener("change", () => { on = box.checked; if (on && !viewer.edges) viewer.edges = true; apply(); if (!on) clear(); });
  turn.addEventListener("input", () => { degrees = +turn.value; value.textContent = `${degrees}°`; turn.setAttribute("aria-valuetext", `${degrees}°`); });
  button.addEventListener("click", clear);
  set.append(make("label", {}, box, " pick faces"), slider, button, help);
  form.append(set);
  apply();
  return {
    // Whether a click on a face, -1 for none, is taken.
    click(face, shift) {
      if (!on) return false;
      if (face >= 0 && !isFace(face)) return true;
      if (face < 0) { if (!shift) clear(); return true; }
      const found = smoothFace(face), known = picked.has(key(cornersOf(face)));
      if (!shift) picked.clear();
      for (const [name, corners] of found) if (shift && known) picked.delete(name); else picked.set(name, corners);
      changed();
      return true;
    },
    clear,
  };
}
