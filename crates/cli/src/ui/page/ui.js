// The page of `slipstick ui`. All that it knows comes from the server, and all that it does is a request.
const element = id => document.getElementById(id);
const LINE = 1.5 * 13, PAUSE = 350, LOOK = 1000; // px, ms, ms
// one of several pages of a browser, each with its own text
const page = Math.random().toString(36).slice(2);
const now = { case: "", step: "", steps: [], before: null, run: "", stamp: "", saved: "", kind: "", tab: "model", log: "run", commands: [], job: null, record: null, marked: null, wanted: null, started: false, returns: false };
async function ask(path, { body } = {}) {
  const answer = await fetch(path, body === undefined ? {} : { method: "POST", body }), data = await answer.json();
  if (!answer.ok) throw new Error([data.error, data.cure].filter(text => text).join("\n"));
  return data;
}
const query = values => Object.entries(values).map(([name, value]) => `${name}=${encodeURIComponent(value)}`).join("&");
function fail(error) {
  const box = element("failure");
  box.hidden = !error;
  box.textContent = !error ? "" : error instanceof TypeError ? "The program does not answer. Is `slipstick ui` still running? Your text is still here." : error.message;
}
// A word of a command line, quoted as the server does.
const shellWord = word => /^[\p{L}\p{N}_.\/,=:-]+$/u.test(word) ? word : /["$`\\!]/.test(word) ? `'${word.replaceAll("'", "'\\''")}'` : `"${word}"`;
const attempt = work => async (...given) => { try { fail(null); await work(...given); } catch (error) { fail(error); } };

// What is open is in the address, so that it can be loaded again.
const remember = () => history.replaceState(null, "", `#${query({ case: now.case, run: now.run })}`);
const remembered = () => Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
async function names() {
  const found = await ask("folder");
  element("folder").textContent = found.folder;
  now.steps = found.steps;
  fill("case", [...found.cases, ...found.steps], now.case || now.step, "none");
  fill("run", found.runs, now.run, "none");
  fill("other", found.runs.filter(name => name !== now.run), other ? other.name : "", "no other run");
  return found;
}
function fill(id, all, chosen, none) {
  element(id).replaceChildren(...["", ...all].map(name => make("option", { value: name }, name || none)));
  element(id).value = chosen;
}

// The text.
const source = element("source"), changed = () => now.case !== "" && source.value !== now.saved;
function lines() { return source.value.split("\n"); }
function fit() {
  const all = lines();
  element("numbers").textContent = all.map((_, k) => k + 1).join("\n") + "\n";
  source.style.height = `${all.length * LINE + 12}px`;
  source.style.width = `${all.reduce((most, line) => Math.max(most, line.length), 20) + 60}ch`;
  element("save").classList.toggle("changed", changed());
  element("save").disabled = !changed();
  element("text-title").textContent = now.case ? `${now.case}${changed() ? " (not saved)" : ""}` : now.run ? `Case of the run ${now.run} (a record, which cannot be changed)` : "Case file";
}
function comment(all) {
  now.diagnostics = all;
  const own = lines();
  element("comments").replaceChildren(...all.map(of => {
    const note = make("div", { class: of.severity }, `← ${of.message}`);
    note.style.top = `${(of.line - 1) * LINE}px`;
    note.style.left = `${(own[of.line - 1] || "").length + 2}ch`;
    return note;
  }));
  element("diagnostics").replaceChildren(...all.map(of => {
    const button = make("button", { type: "button" }, make("span", { class: of.severity }, `${of.severity} in line ${of.line}`), `: ${of.message}`, make("small", {}, `${of.help}${of.help ? " " : ""}[${of.code}]`));
    button.addEventListener("click", () => go(of.line));
    return make("li", {}, button);
  }));
  const count = word => all.filter(of => of.severity === word).length, [errors, warnings] = [count("error"), count("warning")];
  const counted = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
  element("verdict").textContent = all.length ? `${counted(errors, "error")}, ${counted(warnings, "warning")}` : "The text is a valid case; Check also builds and inspects it.";
}
function go(line) {
  if (!line) return;
  const before = lines().slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0), length = (lines()[line - 1] || "").length;
  source.focus({ preventScroll: true });
  source.setSelectionRange(before, before + length);
  element("editor").scrollTop = Math.max(0, (line - 6) * LINE);
}
let waiting = null, asked = 0;
const check = attempt(async () => {
  const turn = ++asked;
  if (!now.case) { comment([]); element("verdict").textContent = ""; await form(); return; }
  const text = source.value, found = await ask(`check?${query({ case: now.case, page })}`, { body: text });
  if (turn !== asked) return; // a later text is being checked
  now.checked = { text, stamp: found.stamp };
  comment(found.diagnostics);
  if (now.kind === "inp" && changed()) element("verdict").textContent = "Decks are checked as saved.";
  if (found.outline) {
    outline(found.outline);
    now.commands = found.runs;
    model();
  } else now.commands = [];
  buttons();
  await form();
});
function typed() {
  fit();
  element("comments").replaceChildren();
  clearTimeout(waiting);
  waiting = setTimeout(check, PAUSE);
}
source.addEventListener("input", typed);
const store = attempt(async () => {
  if (!changed()) return;
  // a text field has no carriage returns
  const text = source.value, body = now.returns ? text.replaceAll("\n", "\r\n") : text;
  const { stamp } = await ask(`save?${query({ case: now.case, stamp: now.stamp })}`, { body });
  Object.assign(now, { stamp, saved: text });
  fit();
  element("status").textContent = `saved ${now.case}`;
  if (now.kind === "inp") check();
});
// one after the other, since each needs the stamp of the one before; one waits at most
let saving = Promise.resolve(), waits = null;
const save = () => waits ||= saving = saving.then(() => { waits = null; return store(); });
addEventListener("keydown", event => {
  if (!(event.ctrlKey || event.metaKey) || event.key !== "s") return;
  event.preventDefault();
  if (!event.repeat) save();
});
element("save").addEventListener("click", save);
addEventListener("beforeunload", event => { if (changed()) event.preventDefault(); });

// The parts.
function outline(groups) {
  element("outline").replaceChildren(...groups.map(({ title, items }) => make("div", {}, make("h2", {}, title), make("ul", {}, ...items.map(item => {
    const button = make("button", { type: "button", "aria-pressed": "false" }, item.name || item.text || title.toLowerCase(), ...item.name && item.text ? [make("small", {}, item.text)] : []);
    button.addEventListener("click", () => {
      const again = button.getAttribute("aria-pressed") === "true";
      element("outline").querySelectorAll("button").forEach(other => other.setAttribute("aria-pressed", "false"));
      button.setAttribute("aria-pressed", String(!again));
      mark(again ? [] : item.marks);
      if (!again) { formPath = item.path; added.clear(); form().catch(fail); if (!formShown()) go(item.line); else element("editor").scrollTop = Math.max(0, (item.line - 3) * LINE); }
    });
    return make("li", {}, button);
  })))));
}
// Shows surfaces and sets in the model, the slave's in the first colour.
function mark(marks) {
  now.marked = marks.map((name, k) => [name, k]);
  if (now.tab !== "model" && marks.length) { show("model"); return; }
  post(frame, { mark: now.marked });
}

// Model and report.
const frame = element("frame");
frame.addEventListener("load", () => {
  frame.classList.remove("loading");
  frame.dataset.shows = shown;
  now.model = now.tab === "model" ? coming : null;
  unpicked();
  if (now.tab === "model" && now.marked) post(frame, { mark: now.marked });
  if (camera && camera.of === cameraKey()) post(frame, { camera: camera.at });
  if (now.tab === "report" && now.wanted) post(frame, { show: now.wanted });
});
let shown = "", coming = null; // and the text of the model that is being loaded
function loadIn(one, address) {
  one.classList.add("loading");
  one.contentWindow.location.replace(address ? new URL(address, location.href) : "about:blank");
}
function load(address) {
  shown = address;
  states[0] = null;
  loadIn(frame, address);
}
let version = 0;
function model() {
  if (now.tab !== "model") return;
  unpicked();
  coming = now.checked; // the text that was checked last
  load(`model?${query({ case: now.case, run: now.run, page, stamp: coming ? coming.stamp : "", version: ++version })}`);
}
function choose(tab) {
  now.tab = tab;
  for (const name of ["model", "report"]) element(`tab-${name}`).setAttribute("aria-selected", String(name === tab));
  frame.title = tab === "model" ? "Model" : "Report of the run";
  element("reload").hidden = tab === "model";
  if (tab !== "model") element("pick").hidden = true;
}
function show(tab) {
  choose(tab);
  if (tab === "model") model(); else load(now.run ? `report?${query({ run: now.run, view: Boolean(other), version: ++version })}` : "");
}
// pressed again, it checks the text again, whose model another page may have replaced
element("tab-model").addEventListener("click", () => { if (now.tab === "model" && now.case) check(); else show("model"); });
element("tab-report").addEventListener("click", () => show("report"));
element("reload").addEventListener("click", () => show("report"));
element("tabs").addEventListener("keydown", event => {
  if (event.key !== "ArrowLeft" && event.key !== "ArrowRight" || element("tab-report").disabled) return;
  const tab = now.tab === "model" ? "report" : "model";
  show(tab); element(`tab-${tab}`).focus();
});

// What the frames report: picked faces, the direction of view, and which state they show.
const FRAME_WAIT = 300; // ms
let picks = { points: [], degrees: 30 }, asking = null, pickTurn = 0, camera = null;
const post = (to, message) => to.contentWindow.postMessage(message, "*");
addEventListener("message", ({ data: told, source: from }) => {
  if (!told || from !== frame.contentWindow && from !== second.contentWindow) return;
  follow(from, told);
  if (from !== frame.contentWindow) return;
  if (told.camera) camera = { of: cameraKey(), at: told.camera };
  // while the next model is loaded, the one that is shown is not that of the text
  if (Array.isArray(told.picked) && told.picked.every(Number.isInteger) && now.tab === "model" && !frame.classList.contains("loading")) {
    picks = { points: told.picked, degrees: Number(told.degrees) };
    clearTimeout(asking);
    asking = setTimeout(pickedText, FRAME_WAIT);
  }
  if (told.revealed && now.wanted) revealed(told.revealed);
});
// A direction of view is kept as long as the same bodies are shown.
const cameraKey = () => now.tab === "model" ? `${now.case} ${now.case ? "" : now.run}` : `run ${now.run}`;
function unpicked() {
  clearTimeout(asking);
  pickTurn++;
  picks.points = [];
  element("pick").hidden = true;
}
const pick = sure => ask(`pick?${query({ case: now.case, stamp: now.model ? now.model.stamp : "", name: element("pick-name").value, use: element("pick-use").value, degrees: picks.degrees, sure })}`, { body: JSON.stringify(picks.points) });
// Shows the text that selects the picked faces.
async function pickedText() {
  const turn = ++pickTurn, faces = picks.points.length / 4, text = element("pick-text");
  element("pick").hidden = !faces;
  if (!faces) return;
  element("pick-count").className = "";
  if (!now.case) {
    element("pick-count").textContent = "The case of a run is a record, which cannot be changed: choose a case above, and pick there.";
    element("pick-write").disabled = text.hidden = element("pick-line").hidden = true;
    return;
  }
  element("pick-count").textContent = `${faces} face${faces === 1 ? "" : "s"} picked; looking for what selects them …`;
  element("pick-write").disabled = true;
  try {
    const found = await pick(false);
    if (turn !== pickTurn) return;
    element("pick-count").textContent = found.known ? `${found.facets}, area ${found.area}: the surface “${found.surfaces[0]}”, which has this name already.` : `${found.facets}, area ${found.area}. This selects exactly these:`;
    text.textContent = found.added; text.hidden = !found.added;
    element("pick-write").disabled = !found.added;
    element("pick-line").hidden = false;
    element("pick-line").replaceChildren("Command line: ", make("code", {}, `slipstick check ${shellWord(now.case)}`), " lists all surfaces with area and mean normal.");
  } catch (error) {
    if (turn !== pickTurn) return;
    element("pick-count").className = "error";
    element("pick-count").textContent = error.message;
    text.hidden = element("pick-line").hidden = true;
  }
}
for (const [id, event] of [["pick-name", "input"], ["pick-use", "change"]]) element(id).addEventListener(event, () => { clearTimeout(asking); asking = setTimeout(pickedText, FRAME_WAIT); });
element("pick").addEventListener("submit", event => { event.preventDefault(); write(); });
// The server tries the text once more, in the case, before it is written.
const write = attempt(async () => {
  element("pick-write").disabled = true;
  const of = now.model, found = await pick(true);
  if (!of || now.model !== of || source.value !== of.text) throw new Error("The text has changed meanwhile; pick again.");
  replaceText(found.text);
  now.marked = found.surfaces.map((name, k) => [name, k]);
  unpicked();
  clearTimeout(waiting);
  await check();
  const line = lines().findLastIndex(text => text.includes(`"${found.surfaces[0]}"`)) + 1;
  go(line);
  element("status").textContent = `wrote “${found.surfaces.join("” and “")}”; not saved yet`;
});
// Replaces the text from the first character that differs to the last, so that it can be undone.
function replaceText(text) {
  const old = source.value;
  let from = 0, end = 0;
  while (from < Math.min(old.length, text.length) && old[from] === text[from]) from++;
  while (end < Math.min(old.length, text.length) - from && old[old.length - 1 - end] === text[text.length - 1 - end]) end++;
  source.focus({ preventScroll: true });
  source.setSelectionRange(from, old.length - end);
  const part = text.slice(from, text.length - end);
  if (!(part ? document.execCommand("insertText", false, part) : document.execCommand("delete"))) source.value = text;
  typed();
}

// Shows the state of the run at an iteration (`designs`) or a load step (`steps`).
function reveal(mode, number) {
  const box = element("frames").getBoundingClientRect();
  if (Math.min(box.bottom, innerHeight) - Math.max(box.top, 0) < 0.5 * box.height) element("picture").scrollIntoView({ block: "nearest" });
  now.wanted = { mode, number, again: now.tab !== "report" };
  if (now.tab !== "report") show("report"); else if (!frame.classList.contains("loading")) post(frame, { show: now.wanted });
}
function revealed({ mode, number, found }) {
  const { wanted } = now, what = mode === "steps" ? "load step" : "iteration";
  if (mode !== wanted.mode || number !== wanted.number) return;
  // the page may be older than this state
  if (found !== number && !wanted.again) { wanted.again = true; show("report"); return; }
  now.wanted = null;
  element("status").textContent = found === null ? `the run has not written a state of ${what} ${digits(number)} yet` : found === number ? `${what} ${digits(number)} is shown` : `the run wrote no state of ${what} ${digits(number)}; ${digits(Number(found))} is shown`;
}

// Commands.
// The directory of the results of a command.
function target(command) {
  const stem = now.case.replace(/\.[^.]*$/, ""), shared = now.kind === "inp" && [...element("case").options].some(option => option.value === `${stem}.toml`);
  return stem + (shared ? "_inp" : "") + (command === "solve" ? "_solve" : "");
}
function buttons() {
  const running = Boolean(now.job && now.job.running), elsewhere = Boolean(now.record && now.record.in_progress && !running);
  for (const button of document.querySelectorAll("[data-command]")) {
    const command = button.dataset.command;
    button.disabled = running || (command === "resume" ? !(now.record && now.record.resumable && now.record.exit !== "finished") : command === "check" ? !now.case : command === "export" ? !now.record : command === "new" ? false : !now.commands.includes(command) || elsewhere && now.run === target(command));
  }
  document.querySelector("[data-command=new]").hidden = !(now.step || now.kind === "inp");
  element("swept").hidden = !now.step;
  element("stop").disabled = !running;
  element("stop").textContent = running && now.job.stopping ? "Stop at once" : "Stop";
  element("tab-report").disabled = !now.record;
  if (elsewhere) element("status").textContent = `${now.run} runs in another terminal; stop it there`;
}
const start = attempt(async command => {
  await save();
  if (changed()) return;
  const force = element("force").checked;
  now.job = await ask(`start?${query({ command, case: now.case || now.step, run: now.run, kind: element("kind").value, force, hexahedra: element("hexahedra").checked })}`, { body: "" });
  element("force").checked = false;
  now.log = "job"; now.started = true; now.before = command === "new" ? [...element("case").options].map(option => option.value) : null;
  if (now.job.run) { now.run = now.job.run; now.record = null; remember(); }
  await look();
});
document.querySelectorAll("[data-command]").forEach(button => button.addEventListener("click", () => start(button.dataset.command)));
element("stop").addEventListener("click", attempt(async () => { now.job = await ask("stop", { body: "" }); buttons(); }));

// Progress.
const ENDS = { 0: "done", 2: "wrong input", 3: "the analysis failed", 4: "interrupted; Resume continues an optimization" };
let timer = null, before = { log: "", history: "", quantities: "" };
async function look() {
  clearTimeout(timer);
  const was = Boolean(now.job && now.job.running), { run: name, log: kind } = now;
  let state;
  try { state = await ask(`state?${query({ run: now.run, log: now.log })}`); } catch (error) { fail(error); timer = setTimeout(look, 3 * LOOK); return; }
  if (name !== now.run || kind !== now.log) return; // another run was chosen, and is looked at
  const running = Boolean(state.job && state.job.running), first = !now.record && state.run;
  now.job = state.job; now.record = state.run;
  const of = now.log === "job" ? state.job : null, line = of ? of.line : state.run ? state.run.line.map(shellWord).join(" ") : "none yet";
  element("line").textContent = line;
  const log = element("log");
  if (state.log !== before.log) {
    const follows = log.scrollTop + log.clientHeight >= log.scrollHeight - 30;
    log.textContent = state.log; log.hidden = !state.log;
    if (follows) log.scrollTop = log.scrollHeight;
  }
  draw(state.run);
  before = { log: state.log, history: state.run ? state.run.history : "", quantities: state.run ? state.run.quantities : "" };
  element("status").textContent = running ? `${state.job.stopping ? "stopping" : "running"}: ${state.job.line}` : of ? `${of.line.split(" ")[1]}: ${ENDS[of.code] || "ended by the system"}` : state.run ? `${state.run.name}: ${state.run.exit}` : "";
  const ended = (was || now.started) && !running;
  if (!running) now.started = false;
  if (ended && of && of.code && of.code !== 4) fail(new Error(reason(state.log)));
  else if (!of && state.run && state.run.exit === "failed") fail(new Error(state.run.message || "the run failed"));
  if (first || ended) await names();
  if (ended && now.before) {
    const made = [...element("case").options].map(option => option.value).find(value => !now.before.includes(value));
    now.before = null;
    if (made && of && of.code === 0) { await open(made, ""); return; }
  }
  if (first || ended) compared();
  if (ended && state.run && of && of.run) show("report");
  buttons();
  if (running || state.run && state.run.in_progress) timer = setTimeout(look, LOOK);
}
// The error at the end of a log.
function reason(log) {
  const all = log.trim().split("\n"), from = all.findLastIndex(line => /^error|: error: /.test(line));
  return all.slice(from < 0 ? -8 : from).join("\n");
}
const rows = text => { const [head, ...rest] = text.trim().split("\n").map(line => line.split(",")); return text.trim() ? { columns: head, rows: rest.map(row => row.map(cell => cell === "" || Number.isNaN(+cell) ? null : +cell)) } : null; };
const column = (table, name) => table.rows.map(row => row[table.columns.indexOf(name)] ?? null);
const words = name => name.replaceAll("_", " ");
// Tables contain the negative of an objective that is maximized.
const sign = (run, name) => run.objective && run.objective.maximized && name.startsWith("objective") ? -1 : 1;
const drawn = run => `${run ? run.name : ""}/${other ? other.name : ""}`;
function draw(run) {
  const [history, quantities] = [run ? run.history : "", run ? run.quantities : ""];
  if (history === before.history && quantities === before.quantities && element("charts").dataset.run === drawn(run)) return;
  element("charts").dataset.run = drawn(run);
  const h = rows(history), q = rows(quantities), figures = [];
  if (h && h.rows.length) {
    const twin = other && rows(other.history), of = (table, name, factor) => { const at = column(table, "iteration"), all = column(table, name); return x.map(n => { const v = all[at.indexOf(n)] ?? null; return v === null ? null : factor * v; }); };
    const x = [...new Set([...column(h, "iteration"), ...twin ? column(twin, "iteration") : []])].sort((a, b) => a - b);
    const series = name => [[h, run], ...twin && twin.columns.includes(name) ? [[twin, other]] : []].map(([table, one]) => ({ name: twin ? `${words(name)} of ${one.name}` : words(name), values: of(table, name, sign(one, name)) }));
    const put = (title, names) => figures.push(chart(title, x, names.filter(name => h.columns.includes(name)).flatMap(series), { pick: n => reveal("designs", n) }));
    const functions = h.columns.filter(name => h.columns.includes(`multiplier_${name}`)), parts = functions.filter(name => name.startsWith("objective_"));
    put(`Objective${run.objective ? `: ${run.objective.text}` : ""}`, parts.length ? parts : ["objective"]);
    put("Volume fraction", ["volume_fraction"]);
    functions.filter(name => name !== "volume_fraction" && !parts.includes(name)).forEach(name => put(`Constraint: ${words(name)}`, [name]));
    if (column(h, "violation").some(v => v > 0)) put("Largest violation, relative to its bound", ["violation"]);
  }
  element("curve").hidden = !(q && q.rows.length > 1);
  if (q && q.rows.length > 1) {
    const names = q.columns.filter(name => !["load_case", "friction"].includes(name)), known = name => names.includes(name);
    for (const id of ["across", "up"]) {
      const select = element(id), kept = select.value;
      if (select.dataset.names === names.join()) continue;
      select.dataset.names = names.join();
      select.replaceChildren(...names.map(name => make("option", { value: name }, words(name))));
      // the reaction of the support that moves most, along its motion
      const motion = name => Math.max(...column(q, name.replace("reaction", "displacement")).map(v => Math.abs(v || 0)));
      const moving = names.filter(name => name.startsWith("reaction_") && motion(name) > 0).sort((a, b) => motion(b) - motion(a))[0];
      select.value = known(kept) && kept ? kept : id === "up" ? moving || names[names.length - 1] : moving ? moving.replace("reaction", "displacement") : "time";
    }
    const [x, y] = [element("across").value, element("up").value], cases = column(q, "load_case"), several = [...new Set(cases)];
    const twin = other && rows(other.quantities), names2 = twin && twin.columns.includes(x) && twin.columns.includes(y) ? column(twin, "load_case").map(k => several.length > 1 ? `load case ${k + 1} of ${other.name}` : other.name) : [];
    const paths = cases.map(k => names2.length ? (several.length > 1 ? `load case ${k + 1} of ${run.name}` : run.name) : several.length > 1 ? `load case ${k + 1}` : ""), both = name => [...column(q, name), ...names2.length ? column(twin, name) : []];
    figures.push(curve(`Load path: ${words(y)}`, both(x), both(y), words(x), [...paths, ...names2], [], i => reveal("steps", both("step")[i])));
  }
  const focused = [...element("charts").querySelectorAll("svg[tabindex]")].indexOf(document.activeElement);
  element("charts").replaceChildren(...figures.filter(figure => figure));
  if (focused >= 0) { const again = element("charts").querySelectorAll("svg[tabindex]")[focused]; if (again) again.focus({ preventScroll: true }); }
}
for (const id of ["across", "up"]) element(id).addEventListener("change", () => { element("charts").dataset.run = ""; before.history = "\n"; draw(now.record); });

// Cases and runs.
let opened = 0;
async function open(name, run) {
  const turn = ++opened, step = now.steps.includes(name) ? name : "";
  if (step) name = "";
  let found = { text: "", stamp: "" };
  source.readOnly = true;
  try {
    await saving;
    if (name || run) found = await ask(`case?${query({ case: name, run })}`);
  } catch (error) {
    if (turn !== opened) return;
    element("case").value = now.case || now.step;
    element("run").value = now.run;
    source.readOnly = !now.case;
    throw error;
  }
  if (turn !== opened) return; // another one is being opened
  clearTimeout(waiting);
  Object.assign(now, { case: name, step, run, kind: name.split(".").pop().toLowerCase(), checked: null, model: null, marked: null, wanted: null, record: null, commands: [], log: now.job && now.job.running && now.job.run === run ? "job" : "run" });
  fill("run", [...element("run").options].map(option => option.value).filter(value => value), run, "none");
  element("case").value = name || step;
  if (other) await compare("");
  remember();
  element("outline").replaceChildren();
  source.value = now.saved = found.text;
  source.readOnly = !name;
  now.stamp = found.stamp;
  now.returns = found.text.includes("\r\n");
  now.saved = source.value;
  fit();
  element("editor").scrollTop = 0;
  choose("model");
  const before = version;
  await check(); // loads the model of a valid text
  await look();
  if (turn !== opened) return;
  if (step) element("verdict").textContent = `${step} is a STEP file. “Make a case of it” meshes it with Gmsh and finds what touches.`;
  if (now.record && now.record.exit === "finished" && !name) show("report");
  else if (version === before) model();
}
element("case").addEventListener("change", attempt(async () => {
  if (changed() && !confirm(`${now.case} has changes that are not saved. Leave them?`)) { element("case").value = now.case || now.step; return; }
  await open(element("case").value, "");
}));
element("run").addEventListener("change", attempt(async () => {
  now.run = element("run").value; now.log = now.job && now.job.running && now.job.run === now.run ? "job" : "run"; now.record = null;
  remember();
  if (!now.case) { await open("", now.run); return; }
  if (other) await compare("");
  await look();
  await names();
  show(now.record ? "report" : "model");
}));
attempt(async () => {
  const found = await names(), wanted = remembered(), state = await ask("state?run=");
  now.job = state.job;
  const name = found.cases.includes(wanted.case) ? wanted.case : found.case || found.step || (found.cases.length === 1 && !found.run ? found.cases[0] : "");
  const running = state.job && state.job.running ? state.job.run : "";
  await open(name, running || (found.runs.includes(wanted.run) ? wanted.run : found.run));
  if (state.job && state.job.running) { now.log = "job"; await look(); }
  if (!name && !found.run) element("verdict").textContent = found.cases.length ? "Choose a case above." : "This folder has no case. `slipstick new` writes one.";
  document.documentElement.dataset.ready = "true";
})();
