// What all charts share: colours, axes, size.
"use strict";
const Charts = (() => {
  const INK = "#4b5863", GRID = "#e3e9ee", BLUE = "#00598c", PLAN = "#b85c00";
  const comma = document.documentElement.lang === "de";
  const write = v => {
    if (v == null) return "";
    const text = String(Number(v.toPrecision(6))).replace("-", "−");
    return comma ? text.replace(".", ",") : text;
  };
  const axis = extra => ({ stroke: INK, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID, width: 1 }, font: "14px system-ui", values: (_u, ticks) => ticks.map(write), ...extra });
  const line = (label, stroke, extra) => ({ label, stroke, width: 2.5, points: { show: false }, spanGaps: false, ...extra });
  const dashed = (label, extra) => line(label, PLAN, { dash: [8, 6], width: 2.5, ...extra });
  const band = { width: 0, points: { show: false } };

  // Two series of equal x as the lower and upper edge of a band.
  const filled = (upper, lower, fill) => ({ series: [upper, lower], fill });

  function make(element, options, data) {
    const size = () => {
      const style = getComputedStyle(element);
      const wide = element.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
      const high = element.clientHeight - parseFloat(style.paddingTop) - parseFloat(style.paddingBottom);
      return { width: Math.max(120, Math.floor(wide)), height: Math.max(80, Math.floor(high)) };
    };
    const chart = new uPlot({ ...size(), legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0], ...options }, data, element);
    new ResizeObserver(() => chart.setSize(size())).observe(element);
    return chart;
  }
  const data = id => JSON.parse(document.getElementById(id).textContent);
  return { axis, line, dashed, band, filled, make, data, write, BLUE, PLAN };
})();
