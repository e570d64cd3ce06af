// Replaces the sections of the jobs whenever they change. Without this script the page reloads itself instead.
const live = document.getElementById("live");

function follow(source) {
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
  follow(new EventSource(live.dataset.events));
}
