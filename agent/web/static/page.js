// On every page: the stop by key and by finger, and whether anything runs that it would stop.
"use strict";
(() => {
  const form = document.getElementById("stop-form");
  const said = document.getElementById("stop-said");
  const PERIOD_MS = 2000;

  const say = (text, failed) => {
    said.textContent = text;
    said.classList.toggle("failed", failed);
  };

  async function stop() {
    try {
      const answer = await fetch("/stop", { method: "POST", redirect: "manual", signal: AbortSignal.timeout(3000) });
      if (!answer.ok && answer.type !== "opaqueredirect") throw new Error(String(answer.status));
      say(document.body.dataset.running ? form.dataset.stopping : "", false);
    } catch {
      say(form.dataset.failed, true);
    }
  }

  form.addEventListener("submit", event => {
    event.preventDefault();
    stop();
  });
  addEventListener("keydown", event => {
    if (event.key === "Escape" && document.body.dataset.running && !event.repeat) {
      event.preventDefault();
      stop();
    }
  });

  // A server that does not answer is no proof that nothing runs: the button then stays as it was.
  async function look() {
    try {
      const status = await (await fetch("/status", { signal: AbortSignal.timeout(3000) })).json();
      if (status.active) document.body.dataset.running = "yes";
      else {
        delete document.body.dataset.running;
        if (!said.classList.contains("failed")) say("", false);
      }
    } catch { /* the next look tells */ }
    setTimeout(look, PERIOD_MS);
  }
  setTimeout(look, PERIOD_MS);
})();
