// Files of a logger: their channels are proposed, mapped by hand, previewed, and imported.
import { ask, clear, connect, mark, openMade } from "./act.js";
import { describe } from "./preview.js";
import { archive } from "./zip.js";

const choose = document.getElementById("read-files");
const mapping = document.getElementById("mapping");
const rows = document.getElementById("mapping-rows");
const preview = document.getElementById("preview");
const text = document.getElementById("mapping-text");
let written = ""; // the text of the mapping as the fields say it
// What conditions may come from: channels and columns as { name, unit }, and named groups of the pattern.
const offered = { channels: [], columns: [], groups: [] };

if (choose) {
  connect(choose, propose);
  connect(mapping, show);
  connect(preview, store);
  mapping.addEventListener("input", follow);
  mapping.addEventListener("change", follow);
  choose.addEventListener("input", ({ target }) => {
    if (target.name === "name") {
      clear(preview);
    } else {
      mapping.hidden = preview.hidden = true;
    }
  });
}

// Follow what was changed in a field.
async function follow({ target }) {
  preview.hidden = true;
  if (target === text) {
    return;
  }
  if (target.id === "map-plan") {
    await readSheet(target.files[0]);
  } else if (target.id === "map-conditions-pattern") {
    readPattern(target);
  }
  arrange();
  write();
}

async function propose() {
  if (!mapping.hidden) { // of the same files: Enter in the field of the name sends the form again
    reveal(preview.hidden ? mapping : preview);
    return;
  }
  const [file] = choose.elements.files.files;
  const subject = choose.elements.subject.value;
  const query = new URLSearchParams(subject);
  query.set("file", file.name);
  const response = await ask("POST", `/v1/recordings/proposal?${query}`, file, { "Content-Type": "application/octet-stream" });
  const proposal = await response.json();
  if (rows.dataset.subject !== subject) {
    rows.innerHTML = await (await ask("GET", `/upload/mapping?${subject}`)).text();
    rows.dataset.subject = subject;
    Object.assign(offered, { columns: [], groups: [] });
  }
  fill(proposal);
  preview.hidden = true;
  reveal(mapping);
}

const controlsOf = element => [...element.querySelectorAll("[data-path]")];
const pathOf = control => JSON.parse(control.dataset.path);
const nameOf = ({ name, unit }) => unit ? `${name} [${unit}]` : name;

// Put the channels and the guesses of a proposal into the fields.
function fill({ channels, guesses, mapping: proposed, open_keys: open }) {
  offered.channels = channels;
  offer();
  for (const unit of rows.querySelectorAll(".condition .unit")) {
    delete unit.dataset.of;
  }
  for (const select of rows.querySelectorAll("select.channels")) {
    select.replaceChildren(select.options[0], ...channels.map(channel => new Option(nameOf(channel), channel.name)));
  }
  for (const control of controlsOf(rows)) {
    const value = pathOf(control).filter(Boolean).reduce((object, key) => object?.[key], proposed);
    if (control.matches(".channels, .unit")) {
      control.value = value ?? "";
    } else if (control.type === "checkbox") {
      control.checked = value !== undefined;
    } else if (control.matches(".source")) {
      control.value = value?.channel ? JSON.stringify(["channel", value.channel]) : "";
    } else if (control.matches(".level")) {
      const how = control.closest(".row").querySelector(".how");
      const key = [...how.options].map(option => option.value).find(option => value?.[option] !== undefined);
      how.value = key ?? how.options[0].value;
      control.value = key ? value[key] : "";
    }
  }
  for (const { name, channel, reason, sure } of guesses) {
    const row = [...rows.querySelectorAll("[data-guess]")].find(({ dataset: { guess } }) => guess === name);
    if (row) {
      row.querySelector(".about").textContent = sure || !channel ? reason : `${reason}. Please check`;
    }
  }
  const note = mapping.querySelector(".open");
  note.hidden = open.length === 0;
  note.textContent = `Left to fill in: ${open.map(name => name.replaceAll("_", " ")).join(", ")}.`;
  arrange();
  write();
}

// Offer what conditions may come from, and keep what is chosen.
function offer() {
  const groups = [["channel", "Channels", offered.channels.map(channel => [nameOf(channel), channel.name])],
    ["column", "Columns of the sheet", offered.columns.map(({ heading }) => [heading, heading])],
    ["name", "Parts of the file name", offered.groups.map(name => [name, name])]];
  for (const select of rows.querySelectorAll("select.source")) {
    const chosen = select.value;
    select.replaceChildren(select.options[0], ...groups.filter(([, , entries]) => entries.length).map(([kind, label, entries]) => {
      const group = Object.assign(document.createElement("optgroup"), { label });
      group.append(...entries.map(([shown, name]) => new Option(shown, JSON.stringify([kind, name]))));
      return group;
    }));
    select.value = chosen;
    if (select.selectedIndex < 0) {
      select.value = "";
    }
  }
}

// Read the headings of the sheet, and choose the columns that are called like conditions.
async function readSheet(file) {
  const head = file ? (await file.slice(0, 1 << 16).text()).replace(/^\uFEFF/, "").split(/\r?\n/)[0] : "";
  const separator = [";", "\t"].find(sign => head.includes(sign)) ?? ",";
  const cells = head.split(new RegExp(`${separator}(?=(?:[^"]*"[^"]*")*[^"]*$)`)).map(cell => cell.trim().replace(/^"(.*)"$/s, "$1").replaceAll('""', '"'));
  offered.columns = cells.filter(Boolean).map(heading => {
    const [, name, unit = ""] = heading.match(/^(.*?)\s*(?:\[([^\]]*)\])?$/);
    return { heading, name, unit };
  }).filter(({ name }) => !["file", "engagement", "run"].includes(name));
  offer();
  const bare = name => name.toLowerCase().replace(/[^\p{L}\p{N}]/gu, "");
  for (const select of rows.querySelectorAll("select.source")) {
    const column = offered.columns.find(({ name }) => bare(name) === bare(pathOf(select)[1]));
    if (column && !select.value && !select.closest(".row").querySelector("input").value) {
      select.value = JSON.stringify(["column", column.heading]);
    }
  }
}

// Read the named groups of the pattern, and say what they are in the name of the first file.
function readPattern(field) {
  const [file] = choose.elements.files.files;
  offered.groups = [...field.value.matchAll(/\(\?P<(\w+)>/g)].map(([, name]) => name);
  offer();
  const place = field.closest(".row").querySelector(".about");
  place.dataset.about ??= place.textContent;
  try {
    const match = file.name.match(new RegExp(field.value.replaceAll("(?P<", "(?<")));
    place.textContent = !field.value ? place.dataset.about : !match ? `does not match ${file.name}` :
      offered.groups.length ? `in ${file.name}: ${offered.groups.map(name => `${name} = ${match.groups[name] ?? "nothing"}`).join(", ")}` :
        "has no named group, such as (?P<J>[0-9.]+)";
  } catch {
    place.textContent = "is not complete";
  }
}

// Show the fields that what is chosen needs.
function arrange() {
  const cut = rows.querySelector('[name="runs.cut"]')?.value;
  for (const row of rows.querySelectorAll("[data-for]")) {
    row.hidden = row.dataset.for !== cut;
  }
  for (const row of rows.querySelectorAll("[data-needs], .instant")) {
    const needs = row.dataset.needs, source = row.querySelector(".source"), unit = row.querySelector(".unit");
    const needed = row.querySelector(".needed"), level = row.querySelector(".level");
    if (source) {
      const [kind, name] = source.value ? JSON.parse(source.value) : [];
      const value = row.querySelector("input");
      value.disabled = Boolean(kind);
      unit.hidden = !kind || (needs === "1" && kind !== "channel");
      if (unit.dataset.of !== source.value) {
        const proposed = unit.dataset.of === undefined ? unit.value : "";
        unit.value = proposed || (kind === "name" && !unit.hidden ? needs : "");
        unit.dataset.of = source.value;
      }
      unit.placeholder = offered[`${kind}s`]?.find(each => (each.heading ?? each.name) === name)?.unit || needs;
    } else if (unit) {
      unit.placeholder = offered.channels.find(({ name }) => name === needed.value)?.unit || needs;
    } else if (level) {
      const how = row.querySelector(".how");
      how.hidden = !needed.value;
      level.hidden = needed.value ? how.value === "changes" : !("alone" in level.dataset);
      level.placeholder = needed.value ? "0.5" : "0 s";
    }
  }
}

// Write what the fields say as the file channels.toml.
function write() {
  const root = {};
  for (const control of controlsOf(rows)) {
    const row = control.closest(".row"), needed = row.querySelector(".needed");
    if (row.hidden || control.disabled || (needed && !needed.value && !("alone" in control.dataset))) {
      continue;
    }
    let [path, value] = [pathOf(control), valueOf(control)];
    if (control.matches(".level")) {
      const how = row.querySelector(".how").value;
      path = [...path.slice(0, -1), needed.value ? how : "time"];
      value = needed.value && how === "changes" ? true : value;
    }
    if (value !== undefined && !(control.hidden && value !== true)) {
      put(root, path, value);
    }
  }
  written = Object.entries(root).map(([section, entries]) =>
    [`[${section}]`, ...Object.entries(entries).map(([key, value]) => `${keyed(key)} = ${toml(value)}`), ""].join("\n")).join("\n");
  text.value = written;
}

function valueOf(control) {
  if (control.type === "file") {
    return control.files[0]?.name;
  }
  const value = control.value.trim();
  if (!value || (control.type === "checkbox" && !control.checked)) {
    return undefined;
  }
  switch (control.dataset.kind) {
    case "json":
      return JSON.parse(value);
    case "source":
      return Object.fromEntries([JSON.parse(value)]);
    case "number": {
      const number = value.replace(/(\d),(\d)/, "$1.$2");
      return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(number) ? Number(number) : number;
    }
  }
  return value;
}

function put(object, [key, ...rest], value) {
  if (rest.length) {
    put(object[key] ??= {}, rest, value);
  } else if (typeof value === "object") {
    Object.assign(object[key] ??= {}, value);
  } else {
    object[key] = value;
  }
}

const keyed = key => /^[\w-]+$/.test(key) ? key : JSON.stringify(key);

// The escapes of JSON are those of TOML.
function toml(value) {
  return typeof value === "object" ?
    `{ ${Object.entries(value).map(([key, inner]) => `${keyed(key)} = ${toml(inner)}`).join(", ")} }` : JSON.stringify(value);
}

async function send(previewed) {
  const query = new URLSearchParams(choose.elements.subject.value);
  query.set("name", choose.elements.name.value);
  if (previewed) {
    query.set("preview", "true");
    query.set("pictures", "6");
  }
  const sheets = [...document.getElementById("map-plan")?.files ?? []];
  const files = [...sheets, ...choose.elements.files.files].map(file => [file.name, file]);
  const content = await archive([["channels.toml", new Blob([text.value])], ...files]);
  return ask("POST", `/v1/recordings/import?${query}`, content, { "Content-Type": "application/zip" });
}

async function show() {
  try {
    const response = await send(true);
    describe(preview.querySelector(".found"), await response.json());
    reveal(preview);
  } catch (error) {
    if (!error.problem || !markRow(error.problem)) {
      throw error;
    }
  }
}

async function store() {
  openMade(await send(false));
}

// Say a problem beside the row whose key or channel it names; false if it names none.
function markRow({ detail, remedy }) {
  const shown = [...rows.querySelectorAll(".row[data-key]")].filter(row => !row.hidden);
  const names = ({ dataset: { key } }) => {
    const [section, ...rest] = key.split("."), name = rest.join(".");
    return new RegExp(`, ${RegExp.escape?.(key) ?? key.replace(/\W/g, "\\$&")}[.:]`).test(detail) ||
      (name && [`${section}: ${name} is missing`, `${section}: '${name}'`, `reads '${name}'`].some(said => detail.includes(said)));
  };
  const named = shown.filter(names).sort((a, b) => b.dataset.key.length - a.dataset.key.length);
  const row = named[0] ?? shown.find(each => [...each.querySelectorAll(".channels")].some(({ value }) => value && detail.includes(`'${value}'`)));
  const field = row?.querySelector("[id]");
  if (!field || !mark(field, tellWrong(row, { detail, remedy }))) {
    return false;
  }
  row.closest("details")?.setAttribute("open", "");
  field.focus();
  return true;
}

// What is wrong with a row: of one that is empty what to do, and of others the problem without its place in a file.
function tellWrong(row, { detail, remedy }) {
  const needed = row.querySelector(".needed"), value = row.querySelector(".level[data-alone], .condition > input");
  const isEmpty = [needed, value, row.querySelector(".source")].every(control => !control?.value.trim());
  if (text.value !== written || !isEmpty || !(needed || value)) {
    const words = text.value === written ? detail.replace(/^channels\.toml, (line \d+, )?[^:]*: /, "") : detail;
    return `${words[0].toUpperCase()}${words.slice(1)}. ${remedy}`;
  }
  return value ? `Choose a channel, or state a ${needed ? "time" : "number"} with its unit` : "Choose a channel";
}

function reveal(form) {
  form.hidden = false;
  const title = form.querySelector("h3");
  title.focus({ preventScroll: true });
  title.scrollIntoView({ block: "start" });
}
