// The planned velocity.
"use strict";
(() => {
  const element = document.getElementById("plan");
  if (!element) return;
  const plan = Charts.data("plan-data");
  if (!plan) return;
  Charts.make(element, {
    scales: { x: { time: false } },
    axes: [Charts.axis({ label: "s", labelSize: 20 }), Charts.axis({ label: "rad/s", labelSize: 20, size: 54 })],
    series: [{}, Charts.dashed("")],
  }, [plan.t, plan.v]);
})();
