// Replaces the sections of the jobs whenever they change. Without this script the page reloads itself instead.
const live = document.getElementById("live");
const source = new EventSource(live.dataset.events);

source.addEventListener("state", event => {
  const focused = live.contains(document.activeElement) ? document.activeElement.getAttribute("href") : null;
  live.innerHTML = event.data;
  if (focused) {
    live.querySelector(`a[href="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  }
});
addEventListener("pagehide", () => source.close());
