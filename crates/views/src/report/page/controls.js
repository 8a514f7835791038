// The controls of the view.
const FRAME_TIME = 400; // ms
function controls({ m, state, designs, steps, available, names, refresh, viewer, box: [low, high], designed }) {
  const form = element("controls");
  const slider = (name, low, high, step, value, text, change) => {
    const shown = make("span", { class: "value" }, text(value)), input = make("input", { type: "range", min: low, max: high, step, value });
    input.value = value;
    input.addEventListener("input", () => { shown.textContent = text(+input.value); input.setAttribute("aria-valuetext", text(+input.value)); change(+input.value); refresh(); });
    input.setAttribute("aria-valuetext", text(value));
    const label = make("label", {}, name, shown, input);
    form.append(label);
    return label;
  };
  // Shows all frames of a slider, one after the other, until it is pressed again.
  let playing = null;
  const player = (label, what) => {
    const input = label.querySelector("input"), button = make("button", { type: "button", "aria-label": `Play ${what}` }, "▶ Play");
    const stop = () => { clearInterval(timer); playing = timer = null; button.className = ""; button.textContent = "▶ Play"; button.setAttribute("aria-label", `Play ${what}`); };
    const at = value => { input.value = value; input.dispatchEvent(new Event("input")); };
    let timer = null, rest = 0;
    const next = () => {
      if (+input.value < +input.max) at(+input.value + 1); else if (++rest > 2) { rest = 0; at(0); }
    };
    button.addEventListener("click", () => {
      if (timer) return stop();
      if (playing) playing.stop();
      if (+input.value === +input.max) at(0);
      rest = 0; timer = setInterval(next, FRAME_TIME); playing = { stop };
      button.className = "playing"; button.textContent = "⏸ Pause"; button.setAttribute("aria-label", `Pause ${what}`);
    });
    const row = make("div", { class: "play" }, button);
    label.replaceWith(row); row.prepend(label);
    return row;
  };
  const select = (name, options, value, change) => {
    const input = make("select"), label = make("label", {}, name, input);
    const fill = (all, now) => { input.replaceChildren(...all.map(([key, text]) => make("option", { value: key }, text))); input.value = now; };
    fill(options, value);
    input.addEventListener("change", () => { change(input.value); refresh(); });
    form.append(label);
    return fill;
  };
  let fields = () => {}, visibility = () => {};
  const fitted = () => { const all = available(); if (!all.includes(state.field)) state.field = all[0]; fields(all.map(f => [f, names[f]]), state.field); visibility(); };
  const shows = designs.length && steps.length ? select("Show", [["steps", `load path of ${pathOf()}`], ["designs", "designs, undeformed"]], state.mode, value => { if (playing) playing.stop(); state.mode = value; fitted(); }) : null;
  fields = select("Colour", available().map(f => [f, names[f]]), state.field, value => { state.field = value; });
  const design = designs.length > 1 ? player(slider("Design of iteration", 0, designs.length - 1, 1, state.design, i => String(designs[i].number), i => { state.design = i; fitted(); }), "designs") : null;
  const step = steps.length > 1 ? player(slider("Load step", 0, steps.length - 1, 1, state.step, i => `${steps[i].number}${steps[i].load_case ? `, ${steps[i].load_case}` : ""}, t = ${digits(steps[i].time)}`, i => { state.step = i; fitted(); }), "load path") : null;
  if (designed) slider("Elements with density above", 0, 0.99, 0.01, state.threshold, v => v.toFixed(2), v => { state.threshold = v; });
  const scale = steps.length ? slider("Displacement factor", 0, 5, 0.1, state.scale, v => v.toFixed(1), v => { state.scale = v; }) : null;
  // The half that faces the viewer is removed, so that the cut is seen at once.
  const cut = state.section, place = [0, 1, 2].map(axis => {
    const span = high[axis] - low[axis] || 1;
    const label = slider(`Section at ${"xyz"[axis]}`, low[axis], high[axis], span / 200, cut && cut.axis === axis ? cut.at : 0.5 * (low[axis] + high[axis]), v => digits(v) + data.units[0], v => { state.section.at = v; });
    label.hidden = true;
    return label;
  });
  const set = make("fieldset", {});
  const box = (name, on, change) => { const input = make("input", { type: "checkbox" }); input.checked = on; input.addEventListener("change", () => { change(input.checked); refresh(); }); set.append(make("label", {}, input, " ", name)); };
  m.bodies.forEach((body, b) => box(body.name, !state.hidden.has(b), on => { if (on) state.hidden.delete(b); else state.hidden.add(b); }));
  const half = make("input", { type: "checkbox" }), halves = make("label", {}, half, " other half");
  half.checked = Boolean(cut && cut.other);
  half.addEventListener("change", () => { state.section.other = half.checked; state.section.side = -state.section.side; refresh(); });
  const section = () => { place.forEach((label, axis) => { label.hidden = !state.section || state.section.axis !== axis; }); halves.hidden = !state.section; };
  select("Section", [["", "none"], ["0", "across x"], ["1", "across y"], ["2", "across z"]], cut ? String(cut.axis) : "", value => {
    const axis = +value, side = viewer.turn()[6 + axis] < 0 ? -1 : 1;
    half.checked = false;
    state.section = value === "" ? null : { axis, side, other: false, at: +place[axis].querySelector("input").value };
    section();
  });
  place.forEach(label => form.append(label));
  if (designed) box("smooth", state.smooth, on => { state.smooth = on; });
  viewer.edges = !(designed && state.smooth);
  box("edges", viewer.edges, on => { viewer.edges = on; });
  const reset = make("button", { type: "button" }, "Reset view");
  reset.addEventListener("click", () => { viewer.reset(); viewer.draw(); });
  set.append(halves, reset);
  section();
  form.append(set);
  visibility = () => { if (design) design.hidden = state.mode !== "designs"; [step, scale].forEach(s => { if (s) s.hidden = state.mode !== "steps"; }); };
  visibility();
  return {
    // Shows a frame: its mode and index.
    to(mode, index, field) {
      if (playing) playing.stop();
      if (shows) shows([["steps", `load path of ${pathOf()}`], ["designs", "designs, undeformed"]], mode);
      state.mode = mode;
      const row = mode === "steps" ? step : design, input = row && row.querySelector("input");
      if (input) { input.value = index; input.dispatchEvent(new Event("input")); }
      if (field && available().includes(field)) state.field = field;
      fitted();
    },
  };
}
