// Two runs side by side: the views have the same direction, state and colours, and curves are in the same charts.
const second = element("second");
let other = null, states = [null, null], compareTurn = 0;
element("other").addEventListener("change", attempt(() => compare(element("other").value)));
async function compare(name) {
  const turn = ++compareTurn, state = name ? await ask(`state?${query({ run: name })}`) : null;
  if (turn !== compareTurn) return; // another one was chosen
  other = state && state.run;
  states = [null, null];
  element("other").value = name;
  second.hidden = !other;
  second.title = other ? `View of the run ${name}` : "Run to compare with";
  document.querySelector("main").classList.toggle("comparing", Boolean(other));
  if (other) loadIn(second, `report?${query({ run: name, view: true, version: ++version })}`); else loadIn(second, "");
  if (now.record) show("report");
  draw(now.record);
  compared();
}
second.addEventListener("load", () => {
  second.classList.remove("loading");
  if (other && camera) post(second, { camera: camera.at });
});
// What one view shows is shown by the other.
function follow(from, told) {
  if (!other) return;
  const k = from === second.contentWindow ? 1 : 0, twin = k ? frame : second;
  if (told.camera) post(twin, { camera: told.camera });
  if (!told.state) return;
  states[k] = told.state;
  const { mode, number, field, range } = told.state, apart = states[1 - k];
  if (!apart || apart.mode !== mode || apart.number !== number || apart.field !== field) post(twin, { show: { mode, number, field, quiet: true } });
  else if (range && apart.range) {
    const common = [Math.min(range[0], apart.range[0]), Math.max(range[1], apart.range[1])];
    for (const one of [frame, second]) post(one, { range: { field, range: common } });
  }
}
// The last values of both runs.
function compared() {
  const box = element("comparison");
  box.hidden = !other || !now.record;
  if (box.hidden) return;
  const last = run => {
    const values = new Map();
    for (const [text, keep] of [[run.history, name => name === "iteration" || name === "volume_fraction" || !name.startsWith("multiplier") && rows(run.history).columns.includes(`multiplier_${name}`) || name === "objective"], [run.quantities, name => !["step", "load_case", "friction"].includes(name)]]) {
      const found = rows(text);
      if (found && found.rows.length) found.columns.forEach((name, k) => { const value = found.rows[found.rows.length - 1][k]; if (keep(name) && value !== null) values.set(name, sign(run, name) * value); });
    }
    return values;
  };
  const [a, b] = [now.record, other].map(last), names = [...new Set([...a.keys(), ...b.keys()])];
  const change = name => a.has(name) && b.has(name) && a.get(name) ? `${digits(100 * (b.get(name) / a.get(name) - 1), 2)} %` : "";
  box.replaceChildren(table(["at the end", now.run, other.name, "difference"], names.map(name => [words(name), a.get(name) ?? "", b.get(name) ?? "", change(name)])));
}
