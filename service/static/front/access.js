// Requests to the operations of the service, with the token of this tab if one was asked for.
const KEY = "slipstick-token";

// Send a request; where the service refuses it for want of a token or of a role, ask for one and send it again.
export async function send(method, address, body, headers = {}) {
  for (;;) {
    const token = sessionStorage.getItem(KEY);
    // Not relative to the address of the page, which may have been opened with a user and a password in it.
    const response = await fetch(new URL(address, location.origin), {
      method, body, redirect: "error",
      // Without a token of this tab, the browser adds the one that it was given to open the page.
      credentials: token ? "omit" : "same-origin",
      headers: { Accept: "application/json", ...headers, ...(token ? { Authorization: `Bearer ${token}` } : {}) },
    });
    if (response.ok || ![401, 403].includes(response.status)) {
      return response;
    }
    const problem = await response.clone().json();
    if (problem.type.endsWith("cross-site") || !await askToken(problem)) {
      return response;
    }
  }
}

// Ask for a token in a dialog; false if the person does not want to give one.
function askToken(problem) {
  const dialog = document.createElement("dialog");
  dialog.className = "token";
  dialog.setAttribute("aria-labelledby", "token-title");
  dialog.innerHTML = `<form method="dialog" class="act"><h2 id="token-title">A token is needed</h2><p id="token-why"></p>
    <div class="field"><label for="token">Token</label>
    <input id="token" type="password" autocomplete="off" required aria-describedby="token-why token-kept">
    <span class="about" id="token-kept">kept until this tab is closed, and sent with its requests only</span></div>
    <p class="send"><button value="use">Use this token</button>
    <button value="cancel" class="quiet" formnovalidate>Cancel</button></p></form>`;
  dialog.querySelector("#token-why").textContent = `${problem.detail}.`;
  document.body.append(dialog);
  dialog.showModal();
  return new Promise(resolve => dialog.addEventListener("close", () => {
    const token = dialog.querySelector("input").value.trim();
    dialog.remove();
    if (dialog.returnValue !== "use" || !token) {
      return resolve(false);
    }
    sessionStorage.setItem(KEY, token);
    resolve(true);
  }));
}
