// Files of a logger: their channels are proposed, mapped by hand, previewed, and imported.
import { ask, connect, mark, openMade } from "./act.js";
import { archive } from "./zip.js";

const choose = document.getElementById("read-files");
const mapping = document.getElementById("mapping");
const preview = document.getElementById("preview");
const text = document.getElementById("mapping-text");

if (choose) {
  connect(choose, propose);
  connect(mapping, show);
  connect(preview, store);
  mapping.addEventListener("input", event => event.target === text || write());
  choose.addEventListener("change", () => {
    mapping.hidden = preview.hidden = true;
  });
  mapping.addEventListener("change", () => {
    preview.hidden = true;
  });
}

async function propose() {
  const [file] = choose.elements.files.files;
  const query = new URLSearchParams({ file: file.name, bench: choose.elements.bench.value });
  const response = await ask("POST", `/v1/recordings/proposal?${query}`, file, { "Content-Type": "application/octet-stream" });
  fill(await response.json());
  preview.hidden = true;
  reveal(mapping);
}

// Put the channels and the guesses of a proposal into the rows.
function fill({ channels, guesses, mapping: proposed, open_keys: open }) {
  const reasons = Object.fromEntries(guesses.map(({ name, channel, reason, sure }) => [name, sure || !channel ? reason : `${reason}. Please check`]));
  for (const row of mapping.querySelectorAll("[data-key]")) {
    const [section, name = section] = row.dataset.key.split(".");
    const value = name === section ? proposed[section] : proposed[section]?.[name];
    const select = row.querySelector("select");
    const blank = select.options[0];
    select.replaceChildren(blank, ...channels.map(channel =>
      new Option(channel.unit ? `${channel.name} [${channel.unit}]` : channel.name, channel.name)));
    select.value = value?.channel ?? "";
    const unit = row.querySelector(".unit");
    if (unit) {
      const stated = () => channels.find(channel => channel.name === select.value)?.unit;
      const show = () => {
        unit.placeholder = stated() || row.dataset.needs;
      };
      unit.value = value?.unit ?? "";
      select.onchange = show;
      show();
    }
    const sign = row.querySelector(".sign input");
    if (sign) {
      sign.checked = value?.sign === -1;
    }
    const reason = reasons[name === "current_profile" ? "current" : name];
    if (reason) {
      row.querySelector(".about").textContent = reason;
    }
    row.dataset.unit = value?.channel ? value.unit ?? "" : "";
  }
  mapping.elements["shift_command.above"].value = proposed.shift_command?.above ?? "";
  const note = mapping.querySelector(".open");
  note.hidden = open.length === 0;
  note.textContent = `Left to fill in: ${open.map(name => name.replaceAll("_", " ")).join(", ")}.`;
  write();
}

// Write what the fields say as the file channels.toml.
function write() {
  const lines = [];
  for (const row of mapping.querySelectorAll("[data-key]")) {
    const key = row.dataset.key;
    const channel = row.querySelector("select").value;
    if (key.startsWith("conditions.")) {
      continue;
    }
    if (channel) {
      lines.push(`[${key}]`, `channel = ${quoted(channel)}`);
      const unit = row.querySelector(".unit")?.value.trim();
      if (unit) {
        lines.push(`unit = ${quoted(unit)}`);
      }
      if (row.querySelector(".sign input")?.checked) {
        lines.push("sign = -1");
      }
      if (key === "shift_command") {
        lines.push(`above = ${mapping.elements["shift_command.above"].value.trim().replace(",", ".") || 0.5}`);
      }
      lines.push("");
    } else if (key === "shift_command" && mapping.elements["shift_command.time"].value.trim()) {
      lines.push("[shift_command]", `time = ${quoted(mapping.elements["shift_command.time"].value.trim())}`, "");
    }
  }
  lines.push("[conditions]");
  for (const row of mapping.querySelectorAll('[data-key^="conditions."]')) {
    const name = row.dataset.key.split(".")[1];
    const channel = row.querySelector("select").value;
    const value = row.querySelector("input").value.trim();
    if (value) {
      lines.push(`${name} = { value = ${/^[-+]?\d+$/.test(value) ? value : quoted(value.replace(",", "."))} }`);
    } else if (channel) {
      lines.push(`${name} = { channel = ${quoted(channel)}${row.dataset.unit ? `, unit = ${quoted(row.dataset.unit)}` : ""} }`);
    }
  }
  text.value = `${lines.join("\n")}\n`;
}

function quoted(value) {
  return JSON.stringify(value); // the escapes of JSON are those of TOML
}

async function send(previewed) {
  const query = new URLSearchParams({ name: choose.elements.name.value, bench: choose.elements.bench.value });
  if (previewed) {
    query.set("preview", "true");
  }
  const files = [...choose.elements.files.files].map(file => [file.name, file]);
  const content = await archive([["channels.toml", new Blob([text.value])], ...files]);
  return ask("POST", `/v1/recordings/import?${query}`, content, { "Content-Type": "application/zip" });
}

async function show() {
  try {
    const response = await send(true);
    describe(await response.json());
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

// Say a problem beside the row whose key it names; false if it names none.
function markRow({ detail, remedy }) {
  const rows = [...mapping.querySelectorAll("[data-key]")];
  const row = rows.find(({ dataset: { key } }) => detail.includes(key) || detail.includes(`: ${key.split(".")[1]} is missing`));
  const field = row?.querySelector("[id]");
  field?.focus();
  return Boolean(field) && mark(field, `${detail}. ${remedy}`);
}

function describe({ recordings, engagements, set_aside: aside, computed, remarks, doubts, open_questions: questions }) {
  const { signals, measured_time: times, conditions, condition_units: units } = recordings;
  const columns = Object.keys(units);
  const head = ["engagement", "shifting time [s]", ...columns.map(name => `${name.replaceAll("_", " ")}${units[name] === "1" ? "" : ` [${units[name].replace("^2", "²")}]`}`)];
  const rows = engagements.map((label, number) =>
    [label, times[number].toPrecision(4), ...columns.map(name => String(Number((conditions[number].values ?? conditions[number])[name].toPrecision(5))))]);
  const sentence = `${engagements.length} of ${engagements.length + aside.length} engagements, each cut from ${signals.start.toPrecision(3)} s ` +
    `to ${signals.end.toPrecision(3)} s after its shift command, ${signals.samples} samples of ${Object.keys(signals.units).join(", ").replaceAll("_", " ")}. ` +
    `The shifting times ${computed ? "follow from the speeds" : "are those of the files"}.`;
  preview.querySelector(".found").replaceChildren(
    element("p", sentence, "lead"),
    ...list("What looks wrong", doubts, "warnings"),
    ...list("Set aside", aside.map(({ engagement, reason }) => `${engagement}: ${reason}`), "warnings"),
    table(head, rows), ...list("Detected or assumed", remarks), ...list("Left open", questions));
}

function element(name, content, className = "") {
  return Object.assign(document.createElement(name), { textContent: content, className });
}

function list(title, lines, className = "") {
  if (lines.length === 0) {
    return [];
  }
  const box = element("div", "", className), items = element("ul", "");
  items.append(...lines.map(line => element("li", line)));
  box.append(element("h4", title), items);
  return [box];
}

function table(head, rows) {
  const made = document.createElement("table"), box = element("div", "", "wide");
  made.createTHead().insertRow().append(...head.map(cell => element("th", cell)));
  const body = made.createTBody();
  for (const [label, ...cells] of rows) {
    body.insertRow().append(element("th", label), ...cells.map(cell => element("td", cell)));
  }
  box.tabIndex = 0;
  box.append(made);
  return box;
}

function reveal(form) {
  form.hidden = false;
  const title = form.querySelector("h3");
  title.focus({ preventScroll: true });
  title.scrollIntoView({ block: "start" });
}
