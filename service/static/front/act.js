// Sends the forms of a page to the operations of the service, and says errors beside the fields that they are about.
import { send } from "./access.js";

const TYPES = { h5: "application/x-hdf5", hdf5: "application/x-hdf5", csv: "text/csv", toml: "application/toml" };

export function connect(form, submit) {
  const button = form.querySelector("button");
  const status = form.querySelector(".busy");
  button.disabled = false;
  form.addEventListener("input", ({ target }) => {
    const place = target.closest(".row, .field");
    if (place) {
      clear(place);
    }
  });
  form.addEventListener("submit", async event => {
    event.preventDefault();
    clear(form);
    if (!check(form) || button.disabled) {
      return;
    }
    button.disabled = true;
    status.textContent = "Working …";
    try {
      await submit();
    } catch (error) {
      tell(form, error.problem ?? { detail: "The service does not answer", remedy: "Check that it runs, and try again" });
      if (!error.problem) {
        console.info(error);
      }
    } finally {
      button.disabled = false;
      status.textContent = "";
    }
  });
}

// The response of a request; throws its problem if it was refused.
export async function ask(method, address, body, headers) {
  const response = await send(method, address, body, headers);
  if (!response.ok) {
    const problem = response.headers.get("Content-Type")?.includes("json") ? await response.json() :
      { detail: `The service answers with status ${response.status}`, remedy: "Try again" };
    throw Object.assign(new Error(problem.detail), { problem });
  }
  return response;
}

// Open the page of what an operation has made.
export function openMade(response) {
  open((response.headers.get("Location") ?? "/").replace(/^\/v1/, ""));
}

function open(path) {
  location.assign(new URL(path, location.origin));
}

async function submit(form) {
  const { method, body: kind, then } = form.dataset;
  const { body, query, header } = read(form);
  const file = form.querySelector("input[type=file]")?.files[0];
  const headers = { ...header, ...contentType(kind, file) };
  const content = kind === "json" ? JSON.stringify(body) : kind === "file" ? file : undefined;
  const address = form.getAttribute("action") + (query.size ? `?${query}` : "");
  const response = await ask(method, address, content, headers);
  if (then === "made") {
    openMade(response);
  } else if (then) {
    open(then);
  } else {
    location.reload();
  }
}

function contentType(kind, file) {
  const type = kind === "json" ? "application/json" : TYPES[file?.name.split(".").pop().toLowerCase()];
  return kind === "none" ? {} : { "Content-Type": type ?? "application/octet-stream" };
}

// The fields of a form by where they are sent; empty ones are left to the service.
function read(form) {
  const body = {}, query = new URLSearchParams(), header = {};
  for (const field of form.elements) {
    const { sends, place } = field.dataset;
    const value = sends ? field.value.trim() : "";
    if (sends === "file" || value === "" || (field.type === "checkbox" && !field.checked)) {
      continue;
    }
    if (place === "query") {
      query.set(field.name, value);
    } else if (place === "header") {
      header[field.name] = value;
    } else {
      put(body, field.name.split("."), typed(sends, value));
    }
  }
  return { body, query, header };
}

function typed(sends, value) {
  if (sends === "number") {
    const number = Number(value.replace(",", "."));
    return Number.isNaN(number) ? value : number; // what is no number is refused by the service, in words
  }
  if (sends === "numbers") {
    return value.split(/[;,]?\s+|;/).map(part => typed("number", part)); // a comma within a part is that of a decimal
  }
  return sends === "json" ? JSON.parse(value) : sends === "list" ? [value] : value;
}

function put(object, [key, ...rest], value) {
  if (rest.length) {
    put(object[key] ??= {}, rest, value);
  } else {
    object[key] = Array.isArray(value) ? [...(object[key] ?? []), ...value] : value;
  }
}

function check(form) {
  const faults = [...form.elements].filter(field => field.willValidate)
    .map(field => [field, describeFault(form, field)]).filter(([, words]) => words);
  for (const [field, words] of faults) {
    mark(field, words);
  }
  faults[0]?.[0].focus();
  return faults.length === 0;
}

// What is wrong with the value of a field; empty if nothing is.
function describeFault(form, field) {
  const { valid, valueMissing, patternMismatch } = field.validity;
  if (!valid) {
    return valueMissing ? (field.type === "file" ? "Choose a file" : "Fill in this field") :
      patternMismatch ? field.title : field.validationMessage;
  }
  const name = form.dataset.body === "file" && field.type === "file" ? field.files[0].name : "";
  const endings = field.accept?.split(",") ?? [];
  return !name || endings.some(ending => name.toLowerCase().endsWith(ending)) ? "" :
    `'${name}' does not end in ${endings.join(" or ")}. Choose such a file. ${form.dataset.hint}`.trim();
}

// Say a problem: each field error beside its field, and any other beside the field whose value the problem quotes.
export function tell(form, problem) {
  const fields = [...form.elements].filter(field => field.dataset.sends && field.type !== "hidden");
  const errors = (problem.errors ?? []).map(({ where, what }) =>
    ({ field: fields.find(field => where.split(".").slice(1).join(".").startsWith(field.name)), what, where }));
  const marked = errors.filter(({ field, what }) => field && mark(field, what));
  const rest = errors.filter(({ field }) => !field).map(({ where, what }) => `${where}: ${what}`);
  const hint = problem.status === 422 && !errors.length ? form.dataset.hint : "";
  const words = [`${problem.detail}. ${problem.remedy ?? ""}`, ...rest, ...hint ? [hint] : []].join(" ").trim();
  const quoted = marked.length ? null : fields.find(field => quotes(problem.detail, field));
  if (quoted) {
    mark(quoted, words);
  } else if (!marked.length || rest.length) {
    const alert = form.querySelector(".wrong[role=alert]");
    alert.textContent = words;
    alert.hidden = false;
  }
  (marked[0]?.field ?? quoted)?.focus();
}

function quotes(detail, field) {
  const values = field.type === "file" ? [...field.files].map(file => file.name) : [field.value.trim()];
  return values.some(value => value && (detail.includes(`'${value}'`) || (field.type === "file" && detail.includes(value))));
}

export function mark(field, words) {
  const place = document.getElementById(`${field.id || field.closest("fieldset").id}-wrong`);
  if (!place) {
    return false;
  }
  place.textContent = words;
  place.hidden = false;
  field.setAttribute("aria-invalid", "true");
  return true;
}

export function clear(form) {
  for (const field of form.querySelectorAll("[aria-invalid]")) {
    field.removeAttribute("aria-invalid");
  }
  for (const place of form.querySelectorAll(".wrong")) {
    place.hidden = true;
  }
}

// The name of a file, or the common begin of several ones, is proposed as the name of what is made of it.
function proposeName(form) {
  const [file, name] = [form.querySelector("input[type=file]"), form.querySelector("input[name=name]")];
  let proposed = "";
  file?.addEventListener("change", () => {
    if (name && name.value === proposed && file.files.length) {
      const names = [...file.files].map(each => each.name.replace(/\.[^.]*$/, ""));
      const plain = text => text.replace(/[^A-Za-z0-9_-]+/g, "-").replace(/^[-_]+/, "").slice(0, 64);
      name.value = proposed = plain(commonBegin(names)) || plain(names[0]);
    }
  });
  name?.addEventListener("focus", () => {
    if (proposed && name.value === proposed) {
      name.select();
    }
  });
}

// The longest common begin of names, without a separator or a part of a number at its end.
function commonBegin(names) {
  const [first, ...others] = names;
  let end = first.length;
  while (!others.every(other => other.startsWith(first.slice(0, end)))) {
    end -= 1;
  }
  const begin = first.slice(0, end);
  const isCut = names.some(name => /^\d/.test(name.slice(end))) && /\d$/.test(begin);
  return others.length ? (isCut ? begin.replace(/\d+$/, "") : begin).replace(/[^A-Za-z0-9]+$/, "") : begin;
}

for (const form of document.querySelectorAll("form.act[data-body]")) {
  proposeName(form);
  if (form.dataset.body !== "other") {
    connect(form, () => submit(form));
  }
}
