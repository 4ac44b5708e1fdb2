// Trends over the cycles of an axis; events as dashed lines.
"use strict";
(() => {
  const told = Charts.data("trend-data");
  const seconds = told.at.map(at => Date.parse(at) / 1000);
  const events = told.events.map(event => Date.parse(event.at) / 1000);
  const german = document.documentElement.lang === "de";
  const days = (seconds.at(-1) - seconds[0]) / 86400;
  const date = { month: "2-digit", day: "2-digit" }, time = { hour: "2-digit", minute: "2-digit", hourCycle: "h23" };
  const form = days < 1 ? time : days < 7 ? { ...date, ...time } : date;
  const stamp = s => new Date(s * 1000).toLocaleString(german ? "de-DE" : "en-CA", form).replace(",", "");
  const lines = chart => {
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.strokeStyle = "#8a4600";
    ctx.lineWidth = 3;
    ctx.setLineDash([10, 7]);
    for (const at of events) {
      if (at < chart.scales.x.min || at > chart.scales.x.max) continue;
      const x = Math.round(chart.valToPos(at, "x", true));
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const chart = (id, series, data, bands) => Charts.make(document.getElementById(id), {
    scales: { x: { time: true } }, padding: [10, 48, 0, 0], hooks: { draw: [lines] }, bands,
    axes: [Charts.axis({ values: (_u, ticks) => ticks.map(stamp), space: days >= 1 && days < 7 ? 130 : 70 }), Charts.axis({ size: 64 })], series: [{}, ...series],
  }, [seconds, ...data]);
  const line = colour => Charts.line("", colour, { spanGaps: true, points: { show: true, size: 8, fill: colour } });
  const scaled = (rows, column) => rows.map(row => row[column] === null ? null : 1000 * row[column]);
  for (const [id, rows] of [["trend-coulomb", told.coulomb_nm], ["trend-viscous", told.viscous_nm_s_per_rad]]) {
    chart(id, [Charts.band, Charts.band, line(Charts.BLUE)], [scaled(rows, 2), scaled(rows, 1), scaled(rows, 0)], [Charts.filled(1, 2, "#00598c38")]);
  }
  chart("trend-temperature", [line("#b3201a")], [told.temperature], []);
})();
