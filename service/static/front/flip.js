// The arrow keys show the previous and the next run, as the links do. Fields keep the keys for themselves.
addEventListener("keydown", event => {
  const relation = { ArrowLeft: "prev", ArrowRight: "next" }[event.key];
  const busy = event.altKey || event.ctrlKey || event.metaKey || event.shiftKey
    || event.target.closest("input, select, textarea, [contenteditable], [tabindex=\"0\"], summary");
  const link = relation && !busy && document.querySelector(`a[rel="${relation}"]`);
  if (link) {
    event.preventDefault();
    link.click();
  }
});
