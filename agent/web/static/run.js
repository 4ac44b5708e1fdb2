// The running cycle: twenty points a second from the server, drawn at most once a frame.
"use strict";
(() => {
  const live = document.getElementById("live");
  if (!live) return;
  const stages = JSON.parse(live.dataset.stages);
  const lost = document.getElementById("lost");
  const SILENCE_MS = 2500;
  // time, velocity, its command, torque, arm position, temperature; all on one grid of the period
  let period = 0.05, plan = [], planned = [], columns = [[], [], [], [], []], times = [], began = null, run = null;
  let heard = performance.now(), dirty = true;

  // What hardly changes is not blown up to the size of its noise.
  const calm = least => (_u, low, high) => {
    const middle = ((low ?? 0) + (high ?? 0)) / 2, half = Math.max(least, ((high ?? 0) - (low ?? 0)) * 0.55);
    return [middle - half, middle + half];
  };
  const axes = () => [Charts.axis({ size: 32, label: live.dataset.time, labelSize: 18 }), Charts.axis({ size: 54 })];
  const chart = (id, series, least) => Charts.make(document.getElementById(id), {
    scales: { x: { time: false, range: (_u, low, high) => [low ?? 0, Math.max(high ?? 0, 5)] }, y: { range: calm(least) } },
    axes: axes(), series: [{}, ...series],
  }, [[0], ...series.map(() => [null])]);
  const velocity = chart("chart-velocity", [Charts.dashed(""), Charts.line("", Charts.BLUE)], 5);
  const torque = chart("chart-torque", [Charts.line("", "#00664c", { width: 2 })], 0.5);
  const position = chart("chart-position", [Charts.line("", "#5b3a94", { width: 2 })], 0.5);
  const temperature = chart("chart-temperature", [Charts.line("", "#b3201a", { width: 2 })], 2);

  function grow(length) {
    while (times.length < length) {
      times.push(Number((times.length * period).toFixed(3)));
      for (const column of columns) column.push(null);
      planned.push(null);
    }
  }

  function place() {
    if (began === null) return;
    const first = Math.round(began / period);
    grow(first + plan.length);
    for (let i = 0; i < plan.length; i++) planned[first + i] = plan[i];
  }

  function take(points) {
    for (const [time, ...values] of points) {
      const at = Math.floor(time / period);
      grow(at + 1);
      values.forEach((value, i) => { columns[i][at] = value; });
    }
    const last = points[points.length - 1];
    const show = (id, value, digits) => { document.getElementById(id).textContent = value == null ? "–" : Charts.write(Number(value.toFixed(digits))); };
    if (last) {
      show("now-velocity", last[1], 1);
      show("now-torque", last[3], 2);
      show("now-position", last[4], 1);
      show("now-temperature", last[5], 1);
    }
  }

  function state(now) {
    document.getElementById("stage").textContent = now.stopping && !now.ended ? stages.stopping : stages[now.stage] ?? now.stage;
    document.getElementById("step").textContent = now.step;
    document.getElementById("steps").textContent = now.steps;
    document.getElementById("left").textContent = document.documentElement.lang === "de" ? now.left.replace(".", ",") : now.left;
    const whole = plan.length * period;
    document.getElementById("progress").value = whole ? Math.min(1, Math.max(0, 1 - now.left_s / whole)) : 0;
    if (began === null && now.stair_began_s !== null) {
      began = now.stair_began_s;
      place();
    }
  }

  function reset(told) {
    if (run === told.run) return;
    [run, period, plan, began] = [told.run, told.period_s, told.velocity_rad_s, null];
    [times, planned, columns] = [[], [], [[], [], [], [], []]];
  }

  function draw() {
    const now = performance.now();
    lost.hidden = now - heard < SILENCE_MS;
    if (dirty && times.length) {
      dirty = false;
      const [v, , t, p, c] = columns;
      velocity.setData([times, planned, v]);
      torque.setData([times, t]);
      position.setData([times, p]);
      temperature.setData([times, c]);
    }
    requestAnimationFrame(draw);
  }

  const source = new EventSource("/run/live");
  const on = (kind, act) => source.addEventListener(kind, event => {
    heard = performance.now();
    act(JSON.parse(event.data));
    dirty = true;
    live.dataset.updates = String(Number(live.dataset.updates ?? 0) + 1);
  });
  on("plan", reset);
  on("points", ([now, points]) => { take(points); state(now); });
  on("end", () => { source.close(); location.reload(); });
  requestAnimationFrame(draw);
})();
