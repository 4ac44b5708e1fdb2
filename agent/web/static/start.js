// The list of what holds stays open while it is read anew; the planned velocity.
"use strict";
(() => {
  let open = false;
  document.addEventListener("toggle", event => {
    if (event.target.id === "holding") open = event.target.open;
  }, true); // it does not bubble
  document.addEventListener("htmx:afterSwap", () => {
    const holding = document.getElementById("holding");
    if (holding) holding.open = open;
  });
  const element = document.getElementById("plan");
  if (!element) return;
  const plan = Charts.data("plan-data");
  if (!plan) return;
  Charts.make(element, {
    scales: { x: { time: false } },
    axes: [Charts.axis({ label: element.dataset.time, labelSize: 20, size: 32 }), Charts.axis({ label: "rad/s", labelSize: 20, size: 54 })],
    series: [{}, Charts.dashed("")],
  }, [plan.t, plan.v]);
})();
