// Forms: the fields that the schema has for one table of the text, with the program's messages beside them. A change of
// a field changes that value in the text, and nothing else.
let schema = null, formPath = "", places = new Map(), added = new Set(), formTurn = 0, kept = false, editing = Promise.resolve();
const formShown = () => element("form-switch").getAttribute("aria-pressed") === "true";
element("form-switch").addEventListener("click", attempt(async () => {
  const on = !formShown();
  element("form-switch").setAttribute("aria-pressed", String(on));
  element("text").classList.toggle("with-form", on);
  element("form").hidden = !on;
  if (on) { formPath = ""; await form(); }
}));
// A node of the schema without references and without `null`.
function plain(node) {
  if (!node || typeof node !== "object") return {};
  if (node.$ref) return { ...plain(schema.$defs[node.$ref.split("/").pop()]), ...node.description ? { description: node.description } : {} };
  const real = (node.anyOf || []).filter(one => one.type !== "null");
  if (node.anyOf && real.length === 1 && !node.properties) return { ...plain(real[0]), ...node.description ? { description: node.description } : {} };
  return Array.isArray(node.type) ? { ...node, type: node.type.find(one => one !== "null") } : node;
}
const alternatives = node => [...node.oneOf || [], ...node.anyOf || [], ...node.allOf || []].map(plain);
// The words of a choice, if it has only words.
function choices(node) {
  if (node.enum) return node.enum;
  if (node.const !== undefined) return [node.const];
  const all = alternatives(node).map(choices);
  return all.length && all.every(list => list) ? all.flat() : null;
}
const properties = node => Object.assign({}, ...alternatives(node).map(properties), node.properties || {});
const required = node => [...node.required || [], ...(node.allOf || []).map(plain).flatMap(required)];
const isTable = node => Object.keys(properties(node)).length > 0 && !choices(node);
const itemsOf = node => node.items ? plain(node.items) : alternatives(node).map(itemsOf).find(one => one) || null;
// Without words that only the program's source explains.
const about = node => (node.description || "").replace(/ ?Paper: [^.]*\./g, "").trim();

// Reads the places of all values again, and shows the table that was chosen, or the one at the cursor.
async function form() {
  if (!formShown()) return;
  const turn = ++formTurn;
  schema ||= await ask("schema");
  const all = now.case && now.kind !== "inp" ? await ask("values", { body: source.value }) : [];
  if (turn !== formTurn) return;
  if (!all) { element("form-state").textContent = "The text is not TOML: correct its first error in the text above."; element("fields").inert = true; return; }
  element("fields").inert = false;
  places = new Map(all.map(one => [one.path, one]));
  const tables = all.filter(one => one.kind === "table" && !one.path.includes("."));
  if (!places.has(formPath)) formPath = at(tables, source.value.slice(0, source.selectionStart).split("\n").length);
  const label = of => { const name = places.get(`${of.path}.name`) || places.get(`${of.path}.slave`) || places.get(`${of.path}.set`) || places.get(`${of.path}.surface`); return name ? `${of.path}: ${name.text}` : of.path; };
  element("form-of").replaceChildren(...tables.map(of => make("option", { value: of.path }, label(of))));
  element("form-of").value = formPath;
  element("form-of").disabled = !tables.length;
  element("form-state").textContent = tables.length ? "" : !now.case ? now.run ? "The case of a run is a record, and has no form." : "Choose a case above." : now.kind === "inp" ? "Decks have no form." : "The case has no tables yet.";
  const lists = Object.entries(schema.properties).map(([key, node]) => [key, plain(node)]).filter(([key, node]) => itemsOf(node) || isTable(node) && !places.has(key));
  element("form-add").replaceChildren(make("option", { value: "" }, "add a table …"), ...lists.map(([key, node]) => make("option", { value: itemsOf(node) ? `[[${key}]]` : `[${key}]`, title: about(node) }, key)));
  element("form-add").disabled = now.kind === "inp" || !now.case;
  const root = plain(schema.properties[formPath.replace(/\[.*/, "")]), node = formPath.includes("[") ? itemsOf(root) || {} : root;
  const active = document.activeElement && document.activeElement.closest("#fields") ? document.activeElement : null, focused = active ? active.id : "";
  // what is being typed is kept; the fields are rebuilt when its field is left
  kept = Boolean(active && active.dataset.text !== undefined && active.value !== active.dataset.text);
  if (kept) { messages(); return; }
  element("fields").replaceChildren(...formPath ? fieldsOf(formPath, node) : []);
  if (focused && element(focused)) element(focused).focus({ preventScroll: true });
  messages();
}
// The table in whose lines the cursor lies.
const at = (tables, line) => tables.reduce((best, of) => of.from[0] <= line && (!best || of.from[0] >= best.from[0]) ? of : best, tables[0] || null)?.path || "";
function fieldsOf(path, node) {
  const own = properties(node), present = Object.keys(own).filter(key => places.has(`${path}.${key}`)), needed = required(node);
  // keys that the schema does not know are errors, and shown as such
  const unknown = [...places.keys()].filter(key => key.startsWith(`${path}.`) && !/[.[]/.test(key.slice(path.length + 1)) && !own[key.slice(path.length + 1)]).map(key => key.slice(path.length + 1));
  // in the order of the text
  const place = key => places.get(`${path}.${key}`).from, written = [...present, ...unknown].sort((a, b) => place(a)[0] - place(b)[0] || place(a)[1] - place(b)[1]);
  const shown = [...written, ...Object.keys(own).filter(key => !present.includes(key) && (needed.includes(key) || added.has(`${path}.${key}`)))];
  const missing = Object.keys(own).filter(key => !shown.includes(key));
  const parts = shown.map(key => field(`${path}.${key}`, key, plain(own[key] || {}), needed.includes(key)));
  if (missing.length) {
    const select = make("select", { id: `add-${path}`, "aria-label": `Add a key to ${path}` }, make("option", { value: "" }, "add a key …"), ...missing.sort().map(key => make("option", { value: key, title: about(plain(own[key])) }, key)));
    select.addEventListener("change", () => { const chosen = `${path}.${select.value}`; added.add(chosen); form().then(() => { const input = element(`field-${chosen}`); if (input) input.focus(); }); });
    parts.push(make("div", { class: "add" }, select));
  }
  return parts;
}
function field(path, key, node, needed) {
  const value = places.get(path), entries = value && value.kind === "list" ? [...places.values()].filter(of => of.kind === "table" && of.path.startsWith(`${path}[`) && !/[.[]/.test(of.path.slice(path.length + 1))) : [];
  if (value && value.kind === "table") return make("fieldset", {}, make("legend", {}, key, ...remover(path, needed)), ...note(path, about(node)), ...fieldsOf(path, node));
  if (entries.length) return make("fieldset", {}, make("legend", {}, key), ...note(path, about(node)), ...entries.map((of, k) => make("fieldset", {}, make("legend", {}, `${key}[${k}]`), ...fieldsOf(of.path, itemsOf(node) || {}))));
  const words = choices(node) || (node.type === "boolean" ? ["true", "false"] : null), id = `field-${path}`, text = value ? value.text : "";
  const input = words ? make("select", { id }, ...[...text && words.map(String).includes(text) ? [] : [text], ...words.map(String)].map(word => make("option", { value: word }, word))) : make(text.includes("\n") ? "textarea" : "input", { id, spellcheck: "false", autocomplete: "off", placeholder: value ? "" : isTable(node) ? `{ ${Object.keys(properties(node)).slice(0, 3).join(" = …, ")} = … }` : node.type === "array" ? "[ … ]" : node.type || "" });
  input.value = text;
  if (text.includes("\n")) input.rows = Math.min(12, text.split("\n").length);
  input.dataset.text = input.value;
  input.setAttribute("aria-describedby", `about-${path}`);
  if (needed) input.setAttribute("aria-required", "true");
  input.addEventListener("change", attempt(async () => {
    const { text: before } = input.dataset, entered = input.value;
    if (entered === before) return;
    const word = value ? value.kind === "string" : node.type === "string" || words && node.type !== "boolean";
    if (!word && !entered.trim()) throw new Error(`The field ${path} is empty: enter a value, or remove the key from the text.`);
    input.dataset.text = entered;
    kept = false; // the text that follows rebuilds the fields
    try { await edit(path, word ? JSON.stringify(entered) : entered.trim()); } catch (error) { input.dataset.text = before; throw error; }
  }));
  input.addEventListener("blur", () => { if (kept) { kept = false; form().catch(fail); } });
  return make("div", { class: "field" }, make("label", { for: id }, key), make("span", { class: "value" }, input, ...remover(path, needed)), ...note(path, about(node)));
}
// Removes a key that the text has on lines of its own or in an inline table, and does not need; the focus goes to the list of keys that can be added.
function remover(path, needed) {
  if (!places.get(path)?.removable || needed || !path.includes(".")) return [];
  const button = make("button", { type: "button", class: "remove", id: `remove-${path}`, title: `Remove ${path} from the text`, "aria-label": `Remove ${path} from the text` }, "×");
  button.addEventListener("click", attempt(async () => {
    kept = false;
    await edit(path, null);
    const list = element(`add-${path.slice(0, path.lastIndexOf("."))}`);
    if (list) list.focus();
  }));
  return [button];
}
const note = (path, text) => [make("small", { id: `about-${path}` }, text), make("p", { class: "message", "data-path": path })];
// One after the other, each in the text that the one before has left.
function edit(path, value) {
  const done = editing.then(() => editNow(path, value));
  editing = done.catch(() => {});
  return done;
}
async function editNow(path, value) {
  const of = now.case;
  let sent, text;
  do {
    sent = source.value;
    ({ text } = await ask("edit", { body: JSON.stringify(value === null ? { text: sent, path } : { text: sent, path, value }) }));
    if (now.case !== of) return;
  } while (source.value !== sent);
  const focused = document.activeElement;
  added.delete(path);
  replaceText(text);
  if (focused && focused.id) element(focused.id)?.focus({ preventScroll: true });
  if (value === null) element("form-line").replaceChildren(`Removed ${path}; Ctrl-Z in the text takes that back.`);
  else element("form-line").replaceChildren("As an option of a command: ", make("code", {}, `--set ${shellWord(`${path}=${value}`)}`));
}
// Puts each message beside the innermost value at its place, or above the form if the place is elsewhere in the table.
function messages() {
  if (!formShown() || element("fields").inert) return;
  const before = (a, b) => a[0] < b[0] || a[0] === b[0] && a[1] < b[1], notes = [...element("fields").querySelectorAll(".message")];
  notes.forEach(note => { note.textContent = ""; note.className = "message"; });
  element("fields").querySelectorAll("[aria-invalid]").forEach(input => input.removeAttribute("aria-invalid"));
  const rest = [];
  for (const of of now.diagnostics || []) {
    const place = [of.line, of.column], holding = [...places.values()].filter(one => one.path.startsWith(formPath) && !before(place, one.from) && (before(place, one.to) || one.to[0] === of.line && one.kind !== "table"));
    const inner = holding.sort((a, b) => b.path.length - a.path.length).map(one => notes.find(note => note.dataset.path === one.path)).find(note => note);
    // a key that is unknown is before its value
    const key = inner ? null : [...places.values()].find(one => one.from[0] === of.line && one.path.startsWith(`${formPath}.`) && !before(one.from, place));
    const to = inner || key && notes.find(note => note.dataset.path === key.path), text = `${of.message}${of.help ? `; ${of.help}` : ""}`;
    if (to) {
      to.textContent += `${to.textContent ? " " : ""}${text}`; to.classList.add(of.severity);
      const input = element(`field-${to.dataset.path}`);
      if (input && of.severity === "error") input.setAttribute("aria-invalid", "true");
    } else if (inTable(of.line)) rest.push(make("p", { class: of.severity }, text));
  }
  element("form-messages").replaceChildren(...rest);
}
// Whether a line lies between the header of the form's table and that of the next one.
function inTable(line) {
  const tables = [...places.values()].filter(one => one.kind === "table" && !one.path.includes(".") && one.from[0] <= line).sort((a, b) => a.from[0] - b.from[0]);
  return tables.length > 0 && tables[tables.length - 1].path === formPath;
}
element("form-of").addEventListener("change", attempt(async () => { formPath = element("form-of").value; added.clear(); await form(); const place = places.get(formPath); if (place) element("editor").scrollTop = Math.max(0, (place.from[0] - 3) * LINE); }));
// Adds a table at the end of the text; its form shows the keys that it needs.
element("form-add").addEventListener("change", attempt(async () => {
  const header = element("form-add").value, key = header.replace(/[[\]]/g, "");
  if (!header) return;
  const own = now.case, text = `${source.value.trimEnd()}\n\n${header}\n`, before = source.value;
  if (!await ask("values", { body: text })) throw new Error(`\`${key}\` is an inline list; add the entry there, or write the list as tables.`);
  if (now.case !== own || source.value !== before) throw new Error("The text has changed meanwhile; add the table again.");
  const count = [...places.keys()].filter(path => new RegExp(`^${key}\\[\\d+\\]$`).test(path)).length;
  formPath = header.startsWith("[[") ? `${key}[${count}]` : key;
  replaceText(text);
  clearTimeout(waiting);
  await check();
  const input = element("fields").querySelector("[aria-required]");
  if (input) input.focus();
}));
