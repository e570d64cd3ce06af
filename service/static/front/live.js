// Replaces the sections of the jobs whenever they change. Without this script the page reloads itself instead.
const live = document.getElementById("live");
const silence = Object.assign(document.createElement("p"), { className: "wrong", hidden: true,
  textContent: "The service does not answer. What is shown here was so when it last did." });
silence.setAttribute("role", "alert");

function follow(source) {
  let isLost = false;
  source.addEventListener("open", () => {
    isLost = false;
    silence.hidden = true;
  });
  source.addEventListener("error", () => { // at the end of each stream, and again where the browser cannot connect anew
    silence.hidden = !isLost && source.readyState !== EventSource.CLOSED;
    isLost = true;
  });
  source.addEventListener("state", event => {
    const focused = live.contains(document.activeElement) ? document.activeElement.getAttribute("href") : null;
    live.innerHTML = event.data;
    if (focused) {
      live.querySelector(`a[href="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
    }
  });
  source.addEventListener("end", () => location.reload()); // of a job, whose page then has its results
  source.addEventListener("problem", event => {
    if (JSON.parse(event.data).status === 404) { // the job was deleted: what is shown would stay for ever
      location.reload();
    }
  });
  addEventListener("pagehide", () => source.close());
}

if (live) {
  live.before(silence);
  follow(new EventSource(live.dataset.events));
}
