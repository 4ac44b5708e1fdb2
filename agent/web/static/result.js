// The friction curve against its baseline, and the difference between the two.
"use strict";
(() => {
  const told = Charts.data("curve-data");
  const element = document.getElementById("curve-chart");
  const axes = e => [Charts.axis({ label: `${e.dataset.velocity} / (rad/s)`, labelSize: 24 }), Charts.axis({ label: `${e.dataset.friction} / (N m)`, labelSize: 24, size: 72 })];
  const dots = (stroke, shape) => ({ points: { show: true, size: 9, fill: stroke, stroke, ...shape } });

  // uPlot wants one x for all: the union of both, null where a curve has no point.
  const curves = told.baseline ? [told.now, told.baseline] : [told.now];
  const joined = uPlot.join(curves.map(c => [c.v, c.high, c.low, c.f]));
  const series = [{},
    Charts.band, Charts.band, Charts.line("", Charts.BLUE, { spanGaps: true, ...dots(Charts.BLUE) }),
    Charts.band, Charts.band, Charts.dashed("", { spanGaps: true, ...dots("#fff", { stroke: Charts.PLAN, width: 2 }) })];
  const spanned = series.map(s => ({ ...s, spanGaps: true })).slice(0, joined.length);
  Charts.make(element, {
    scales: { x: { time: false } }, axes: axes(element), series: spanned,
    bands: [Charts.filled(1, 2, "#00598c38"), Charts.filled(4, 5, "#b85c0030")].slice(0, curves.length),
  }, joined);

  const beside = document.getElementById("difference-chart");
  if (beside) {
    const d = told.difference;
    Charts.make(beside, {
      scales: { x: { time: false } }, axes: axes(beside), bands: [Charts.filled(1, 2, "#00598c38")],
      series: [{}, Charts.band, Charts.band, Charts.line("", Charts.BLUE, dots(Charts.BLUE)), { stroke: "#14212b", width: 1.5, points: { show: false } }],
    }, [d.v, d.high, d.low, d.f, d.v.map(() => 0)]);
  }
})();
