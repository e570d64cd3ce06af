// What would be imported: in words, as pictures to flip through, and as a table.

const MOST = 100; // lines of a list or table

// Show the answer of a preview in an element.
export function describe(place, answer) {
  const { set_aside: aside, remarks, doubts, open_questions: questions } = answer;
  const kind = answer.recordings.runs === undefined ? "engagement" : "run";
  place.replaceChildren(
    element("p", `${counted(answer, kind)} ${kind === "run" ? runs(answer) : engagements(answer)}`, "lead"),
    ...list("What looks wrong", doubts, "warnings"),
    ...list("Set aside", aside.map(({ engagement, reason }) => `${engagement}: ${reason}`), "warnings"),
    ...flip(answer.pictures, answer.engagements.length, kind), table(answer, kind),
    ...list("Detected or assumed", remarks), ...list("Left open", questions));
}

function counted({ engagements: kept, set_aside: aside }, kind) {
  return `${kept.length} of ${kept.length + aside.length} ${kind}s${aside.length ? "" : ", none is set aside"}.`;
}

function engagements({ recordings: { signals }, computed }) {
  return `Each is cut from ${signals.start.toPrecision(3)} s to ${signals.end.toPrecision(3)} s after its shift command, ` +
    `${signals.samples} samples of ${Object.keys(signals.units).join(", ").replaceAll("_", " ")}. ` +
    `The shifting times ${computed ? "follow from the speeds" : "are those of the files"}.`;
}

function runs({ recordings: { machine, samples, start, end, signals, commands } }) {
  return `Each of these runs of ${machine} has ${samples} samples from ${start.toPrecision(3)} s to ${end.toPrecision(3)} s ` +
    `after its begin, of ${[...signals, ...commands].join(", ")}.`;
}

// The pictures of the first ones, one after the other by links or arrow keys, as on the page of recordings.
function flip(pictured, count, kind) {
  if (pictured.length === 0) {
    return [];
  }
  const about = kind === "run" ? "Each picture begins at t = 0 of the run." :
    "Dashed: t = 0, where the shift command was put, and the shifting time. Dotted: levels of the conditions.";
  const bar = element("nav", "", "flip"), shown = element("div", "");
  bar.setAttribute("aria-label", `Pictures of the first ${kind}s`);
  shown.setAttribute("aria-live", "polite");
  const show = place => {
    const { label, conditions, pictures } = pictured[place];
    const links = [["← Previous", "prev", place - 1], ["Next →", "next", place + 1]].map(([words, rel, next]) => {
      if (!pictured[next]) {
        return element("span", words, "off");
      }
      const link = Object.assign(element("a", words), { href: "#preview-shown", rel });
      link.addEventListener("click", event => {
        event.preventDefault();
        show(next);
        bar.querySelector(`a[rel=${rel}], a`)?.focus({ preventScroll: true });
      });
      return link;
    });
    bar.replaceChildren(...links, element("span", `${place + 1} of the first ${pictured.length} of ${count}`, "off"));
    const panels = element("div", "", "panels");
    panels.append(...pictures.map(panel));
    const title = element("h4", `${label}${conditions ? `: ${conditions}` : ""}`);
    shown.replaceChildren(title, panels);
  };
  shown.id = "preview-shown";
  show(0);
  return [...pictured.length > 1 ? [bar] : [], shown, element("p", about, "about")];
}

function panel({ title, note, svg }) {
  const figure = element("figure", "", "panel"), picture = element("div", "", "picture");
  picture.append(document.importNode(new DOMParser().parseFromString(svg, "image/svg+xml").documentElement, true));
  figure.append(element("h3", title), picture);
  if (note) {
    figure.append(element("figcaption", note));
  }
  return figure;
}

function table({ recordings, engagements: labels }, kind) {
  const raised = unit => ["1", ""].includes(unit ?? "") ? "" : ` [${unit.replaceAll("^2", "²")}]`;
  const short = number => String(Number(number.toPrecision(5)));
  let columns;
  if (kind === "run") {
    columns = Object.entries(recordings.conditions).map(([name, values]) => [`${name}${raised(recordings.units[name])}`, values.map(short)]);
  } else {
    const values = recordings.conditions.map(condition => condition.values ?? condition);
    columns = [["shifting time [s]", recordings.measured_time.map(time => time.toPrecision(4))],
      ...Object.entries(recordings.condition_units).map(([name, unit]) =>
        [`${name.replaceAll("_", " ")}${raised(unit)}`, values.map(condition => short(condition[name]))])];
  }
  const made = document.createElement("table"), box = element("div", "", "wide");
  made.createTHead().insertRow().append(...[kind, ...columns.map(([head]) => head)].map(cell => element("th", cell)));
  const body = made.createTBody();
  labels.slice(0, MOST).forEach((label, place) =>
    body.insertRow().append(element("th", label), ...columns.map(([, cells]) => element("td", cells[place]))));
  box.tabIndex = 0;
  box.append(made);
  if (labels.length > MOST) {
    box.append(element("p", `and ${labels.length - MOST} more`, "about"));
  }
  return box;
}

function first(lines) {
  return lines.length > MOST ? [...lines.slice(0, MOST), `and ${lines.length - MOST} more`] : lines;
}

function element(name, content, className = "") {
  return Object.assign(document.createElement(name), { textContent: content, className });
}

function list(title, lines, className = "") {
  if (lines.length === 0) {
    return [];
  }
  const box = element("div", "", className), items = element("ul", "");
  items.append(...first(lines).map(line => element("li", line)));
  box.append(element("h4", title), items);
  return [box];
}
