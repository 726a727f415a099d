"use strict";
// Zoom and a cursor with values for the trends of a page: with the mouse, by touch and with the keyboard. Everything it
// knows stands in the page; names and units are set as text, never as HTML.
const enliven = (chart) => {
  const SQUARE = 100000, CLOSEST = 200;
  const area = chart.querySelector(".area"), through = area.querySelector(".through");
  const begin = Number(area.dataset.begin), size = Number(area.dataset.size);
  const length = Number(area.dataset.end) - begin || 1;
  const pointsOf = (shape) => shape.getAttribute("points").split(" ").map((point) => point.split(",").map(Number));
  const panels = [...area.querySelectorAll(".panel")].map((box) => ({
    box, svg: box.querySelector("svg"), grid: box.querySelector(".grid"),
    low: Number(box.dataset.low), high: Number(box.dataset.high), unit: box.dataset.unit,
    lines: [...box.querySelectorAll("polyline")].map((line) => ({
      name: line.dataset.name, level: line.classList.contains("level"),
      side: ["before", "after"].find((side) => line.classList.contains(side)) || "",
      points: pointsOf(line),
    })),
    bands: [...box.querySelectorAll("polygon")].flatMap(pointsOf),
  }));
  let first = 0, last = SQUARE, at = null, pressed = null;

  const add = (tag, parent, name, text) => {
    const element = parent.appendChild(document.createElement(tag));
    if (name) element.className = name;
    if (text) element.textContent = text;
    return element;
  };
  const part = (x) => (x - first) / (last - first);
  const left = (x) => `${100 * part(x)}%`;
  const seconds = (x) => begin + (x / SQUARE) * length;
  const digits = (span) => Math.max(0, Math.min(12, 3 - Math.floor(Math.log10(span))));
  const time = (x) => `${(seconds(x) / size).toFixed(digits((last - first) / SQUARE * length / size))} ${area.dataset.unit}`;

  // Where a line is at a place: at a jump, after it.
  const heightOf = (points, x) => {
    if (x < points[0][0] || x > points[points.length - 1][0]) return null;
    let low = 0, high = points.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (points[middle][0] <= x) low = middle; else high = middle;
    }
    const [x0, y0] = points[low], [x1, y1] = points[high] || points[low];
    return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y0;
  };
  const ticks = (low, high, most, steps = [1, 2, 2.5, 5, 10]) => {
    const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
    const step = steps.map((n) => n * power).find((n) => n >= rough * (1 - 1e-9));
    const found = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1) found.push(Number((i * step).toPrecision(12)));
    return found;
  };

  // The heights that a panel shows: those of its signals in the time that is seen.
  const seen = (panel) => {
    if (first === 0 && last === SQUARE) return [0, SQUARE];
    const heights = [];
    for (const line of panel.lines.filter((one) => !one.level)) {
      for (const x of [first, last]) { const y = heightOf(line.points, x); if (y !== null) heights.push(y); }
      for (const [x, y] of line.points) if (x >= first && x <= last) heights.push(y);
    }
    for (const [x, y] of panel.bands) if (x >= first && x <= last) heights.push(y);
    if (!heights.length) return [0, SQUARE];
    const top = heights.reduce((a, b) => Math.min(a, b)), bottom = heights.reduce((a, b) => Math.max(a, b));
    const room = Math.max(0.06 * (bottom - top), SQUARE / 400);
    return [top - room, bottom + room];
  };

  const draw = () => {
    chart.dataset.from = first;
    chart.dataset.to = last;
    const columns = ticks(seconds(first) / size, seconds(last) / size, 8, [1, 2, 3, 5, 6, 10]);
    const xs = columns.map((tick) => (tick * size - begin) / length * SQUARE);
    for (const panel of panels) {
      const [top, bottom] = seen(panel), value = (y) => panel.high - y / SQUARE * (panel.high - panel.low);
      const rows = ticks(value(bottom), value(top), 5);
      const ys = rows.map((tick) => (panel.high - tick) / (panel.high - panel.low) * SQUARE);
      panel.svg.setAttribute("viewBox", `${first} ${top} ${last - first} ${bottom - top}`);
      panel.grid.setAttribute("d", ys.map((y) => `M${first} ${y}H${last}`).join("") + xs.map((x) => `M${x} ${top}V${bottom}`).join(""));
      for (const old of panel.box.querySelectorAll(".y")) old.remove();
      rows.forEach((tick, i) => { add("span", panel.box, "y", String(tick)).style.top = `${100 * (ys[i] - top) / (bottom - top)}%`; });
      for (const name of panel.box.querySelectorAll(".name, .limit")) name.hidden = first > 0 || last < SQUARE;
    }
    for (const old of area.querySelectorAll(".times .x")) old.remove();
    columns.forEach((tick, i) => { add("span", area.querySelector(".times"), "x", String(tick)).style.left = left(xs[i]); });
    for (const bar of area.querySelectorAll(".bar")) {
      const from = Math.max(Number(bar.dataset.from), first), to = Math.min(Number(bar.dataset.to), last);
      bar.hidden = from > last || to < first;
      bar.style.left = left(from);
      bar.style.width = `${100 * Math.max(to - from, 0) / (last - first)}%`;
    }
    for (const mark of area.querySelectorAll("[data-at]")) {
      mark.style.left = left(Number(mark.dataset.at));
      mark.hidden = Number(mark.dataset.at) < first || Number(mark.dataset.at) > last;
    }
    point();
  };

  const point = () => {
    cursor.hidden = at === null;
    output.textContent = "";
    if (at === null) return;
    cursor.style.left = left(at);
    add("span", output, "", time(at));
    for (const panel of panels) {
      for (const line of panel.lines.filter((one) => !one.level)) {
        const y = heightOf(line.points, at);
        if (y === null) continue;
        const span = panel.high - panel.low, value = (panel.high - y / SQUARE * span).toFixed(digits(span));
        add("span", output, "", [line.name, line.side, value, panel.unit].filter(Boolean).join(" "));
      }
    }
    for (const strip of area.querySelectorAll(".strip")) {
      const on = [...strip.querySelectorAll(".bar")].find((bar) => Number(bar.dataset.from) <= at && at <= Number(bar.dataset.to));
      if (on) add("span", output, "", [strip.querySelector(".row").textContent, on.textContent].filter(Boolean).join(": "));
    }
  };

  const show = (from, to) => {
    const width = Math.min(Math.max(to - from, CLOSEST), SQUARE);
    first = Math.max(0, Math.min(from, SQUARE - width));
    last = first + width;
    if (at !== null) at = Math.max(first, Math.min(last, at));
    draw();
  };
  const zoom = (factor) => {
    const middle = at === null ? (first + last) / 2 : at;
    show(middle - (middle - first) * factor, middle + (last - middle) * factor);
  };
  const shift = (share) => show(first + share * (last - first), last + share * (last - first));
  const move = (to) => {
    at = to;
    if (at < first || at > last) show(at - (last - first) / 2, at + (last - first) / 2); else point();
  };

  const cursor = add("i", through, "cursor"), choice = add("i", through, "choice");
  const tools = document.createElement("div"), output = document.createElement("output");
  tools.className = "tools";
  chart.insertBefore(tools, area);
  chart.insertBefore(output, area);
  for (const [sign, name, action] of [
    ["+", "Zoom in", () => zoom(0.5)], ["−", "Zoom out", () => zoom(2)], ["◀", "Earlier", () => shift(-0.25)],
    ["▶", "Later", () => shift(0.25)], ["↔", "Whole run", () => show(0, SQUARE)],
  ]) {
    const button = add("button", tools, "", sign);
    button.type = "button";
    button.title = name;
    button.setAttribute("aria-label", name);
    button.addEventListener("click", action);
  }
  cursor.hidden = choice.hidden = true;
  area.tabIndex = 0;
  area.setAttribute("role", "group");
  area.setAttribute("aria-label", "Trend: arrow keys move the cursor, plus and minus zoom, Escape shows the whole run");
  area.style.touchAction = "pan-y";

  const KEYS = {
    ArrowLeft: (step) => move((at === null ? last : at) - step), ArrowRight: (step) => move((at === null ? first : at) + step),
    Home: () => move(first), End: () => move(last), "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2),
    PageUp: () => shift(-0.5), PageDown: () => shift(0.5), Escape: () => show(0, SQUARE), "0": () => show(0, SQUARE),
  };
  area.addEventListener("keydown", (event) => {
    if (!(event.key in KEYS) || event.ctrlKey || event.altKey || event.metaKey) return;
    KEYS[event.key]((last - first) * (event.shiftKey ? 0.1 : 0.01));
    event.preventDefault();
  });
  const placeOf = (event) => {
    const box = through.getBoundingClientRect();
    return first + Math.max(0, Math.min(1, (event.clientX - box.left) / box.width)) * (last - first);
  };
  area.addEventListener("pointerdown", (event) => {
    if (event.button === 0 && event.pointerType === "mouse") pressed = placeOf(event);
    move(placeOf(event));
  });
  area.addEventListener("pointermove", (event) => {
    move(placeOf(event));
    choice.hidden = pressed === null;
    if (pressed === null) return;
    choice.style.left = left(Math.min(pressed, at));
    choice.style.width = `${100 * Math.abs(at - pressed) / (last - first)}%`;
  });
  const release = () => {
    if (!chart.isConnected) window.removeEventListener("pointerup", release);
    if (pressed !== null && Math.abs(at - pressed) > (last - first) / 100) show(Math.min(pressed, at), Math.max(pressed, at));
    pressed = null;
    choice.hidden = true;
  };
  window.addEventListener("pointerup", release);
  area.addEventListener("dblclick", () => show(0, SQUARE));
  // A figure that takes the place of another one may show the same part of the run.
  if (chart.dataset.from !== undefined) show(Number(chart.dataset.from), Number(chart.dataset.to));
};
document.querySelectorAll("figure.chart").forEach(enliven);
