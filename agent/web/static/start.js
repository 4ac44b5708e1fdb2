// The planned velocity.
"use strict";
(() => {
  const element = document.getElementById("plan");
  if (!element) return;
  const plan = Charts.data("plan-data");
  if (!plan) return;
  Charts.make(element, {
    scales: { x: { time: false } },
    axes: [Charts.axis({ label: `${element.dataset.time} / s`, labelSize: 22 }), Charts.axis({ label: `${element.dataset.velocity} / (rad/s)`, labelSize: 22, size: 54 })],
    series: [{}, Charts.dashed("")],
  }, [plan.t, plan.v]);
})();
