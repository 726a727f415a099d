"use strict";
// The page around the worker: sliders, the picture, words and findings. What comes from files is set as text; the
// picture is HTML that pidcfg has made and escaped.
const MODULE = "pidcfg.output.browser.session", PATIENCE = 400, LONGEST = 2500;
let model, loop, values = {}, last = {}, running = 0, runs = 0, began = 0, wanted = false, halted = false, hurry;

const number = (value) => String(Number(Number(value).toPrecision(7)));

// --- sliders ---------------------------------------------------------------------------------------------------------
const nearest = (positions, value) => positions.reduce((best, one, i) => Math.abs(one - value) < Math.abs(positions[best] - value) ? i : best, 0);
const names = () => model.loops.map((one) => one.name);
const shown = (knob) => knob.loop === loop || !names().includes(knob.loop);
const GROUPS = { number: "In the PLC", event: "What happens", plant: "The plant, ± 30 %" };

const setKnob = (knob) => {
  const row = document.querySelector(`[data-knob="${CSS.escape(knob.id)}"]`), value = values[knob.id] ?? knob.value;
  if (!row) return;
  const [box, slider] = [row.querySelector("input[type=text]"), row.querySelector("input[type=range]")];
  slider.value = nearest(knob.positions, value);
  slider.setAttribute("aria-valuetext", `${number(value)} ${knob.unit}`.trim());
  if (document.activeElement !== box || box.dataset.sent === box.value) box.value = number(value);
  box.classList.toggle("turned", value !== knob.value);
  row.querySelector(".filed").textContent = value === knob.value ? "" : `as filed ${number(knob.value)}`;
};
const turn = (knob, value) => {
  if (value === knob.value) delete values[knob.id]; else values[knob.id] = value;
  setKnob(knob);
  go();
};
const drawKnobs = () => {
  const place = $("knobs");
  place.textContent = "";
  const locked = model.loops.find((one) => one.name === loop)?.locked;
  for (const [group, title] of Object.entries(GROUPS)) {
    const found = model.knobs.filter((knob) => knob.group === group && shown(knob));
    if (!found.length && !(group === "number" && locked)) continue;
    const set = add(place, "fieldset");
    add(set, "legend", group === "number" ? `${loop} ${title.toLowerCase()}`.replace("in the plc", "in the PLC") : title);
    if (group === "number" && locked) add(set, "p", locked, "soft");
    for (const knob of found) {
      const row = add(set, "div", "", "knob"), i = model.knobs.indexOf(knob);
      row.dataset.knob = knob.id;
      const label = add(row, "label", knob.label);
      label.htmlFor = `slider${i}`;
      const rest = [knob.key, knob.unit].filter(Boolean).join(", ");
      if (rest) add(label, "small", ` (${rest})`);
      const box = add(row, "input"), slider = add(row, "input");
      box.type = "text";
      box.inputMode = "decimal";
      box.autocomplete = "off";
      box.setAttribute("aria-label", `${knob.label}, ${knob.unit || "value"}`);
      slider.type = "range";
      slider.id = `slider${i}`;
      Object.assign(slider, { min: 0, max: knob.positions.length - 1, step: 1 });
      add(row, "span", "", "filed");
      slider.addEventListener("input", () => turn(knob, knob.positions[Number(slider.value)]));
      const typed = () => {
        const value = Number(box.value.trim().replace(",", "."));
        box.dataset.sent = box.value;
        if (box.value.trim() === "" || !Number.isFinite(value)) { box.value = number(values[knob.id] ?? knob.value); return; }
        if (value !== (values[knob.id] ?? knob.value)) turn(knob, value);
      };
      box.addEventListener("change", typed);
      box.addEventListener("keydown", (event) => {
        const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
        if (!way) return;
        event.preventDefault();
        const now = values[knob.id] ?? knob.value, step = knob.step || 10 ** Math.floor(Math.log10(Math.abs(now) || 1) - 2);
        turn(knob, Number((now + way * step).toPrecision(7)));
        box.value = number(values[knob.id] ?? knob.value);
      });
      setKnob(knob);
    }
  }
};

// --- what a run says --------------------------------------------------------------------------------------------------
const drawPicture = (html) => {
  const old = $("picture").querySelector("figure");
  $("picture").innerHTML = html || "<p class=soft>This run has no trend of the loop.</p>";
  const chart = $("picture").querySelector("figure");
  if (!chart) return;
  if (old?.dataset.from !== undefined && old.dataset.loop === loop) Object.assign(chart.dataset, { from: old.dataset.from, to: old.dataset.to });
  chart.dataset.loop = loop;
  enliven(chart);
};
const cells = (row, texts, name = "number") => texts.forEach((text) => add(row, "td", text, name));
const both = (of) => ["before", "now"].map((side) => { const value = of(last.metrics?.[loop]?.[side] ?? {}, last.margins?.[loop]?.[side] ?? {}); return value === null || value === undefined ? "–" : String(value); });
const drawSaid = () => {
  const rows = $("metrics");
  rows.textContent = "";
  for (const [title, of] of [
    ["Overshoot, %", (metric) => metric.overshoot], ["IAE", (metric) => metric.iae], ["Ms", (_, margin) => margin.ms],
    ["Alarms", (metric) => (metric.alarms ?? []).join(", ").replaceAll("_", " ") || "none"],
  ]) {
    const row = add(rows, "tr");
    add(row, "th", title).scope = "row";
    cells(row, both(of), title === "Alarms" ? "" : "number");
  }
  $("why").textContent = last.margins?.[loop]?.now?.why ? `No Ms: ${last.margins[loop].now.why}.` : "";
  const words = $("words");
  words.textContent = "";
  for (const one of last.words ?? []) {
    const row = add(words, "tr");
    add(row, "th", one.address).scope = "row";
    add(row, "td", [one.loop, one.field].filter(Boolean).join(" "));
    add(row, "td", `${one.before ?? "–"} → ${one.after}`, "number");
  }
  $("no-words").hidden = Boolean(last.words?.length);
  $("words-table").hidden = !last.words?.length;
  const list = $("findings");
  list.textContent = "";
  for (const one of last.findings ?? []) {
    const item = add(list, "li", "", `${one.severity}${one.new ? " new" : ""}`);
    add(item, "b", `${one.new ? "new " : ""}${one.severity} ${one.code}`);
    add(item, "span", ` ${one.message}${one.loop ? ` [${one.loop}]` : ""}`);
  }
  $("no-findings").hidden = Boolean(last.findings?.length);
  $("copy-words").disabled = !last.words?.length;
  $("filed").disabled = !Object.keys(values).length;
  $("yaml").textContent = last.yaml ?? "";
};
const take = (answer) => {
  Object.assign(last, answer);
  for (const [id, value] of Object.entries(answer.values ?? {})) {
    const knob = model.knobs.find((one) => one.id === id);
    if (wanted || !knob) continue;
    if (value === knob.value) delete values[id]; else values[id] = value;
    setKnob(knob);
  }
  if (answer.picture !== undefined) drawPicture(answer.picture);
  drawSaid();
};

// --- runs: one at a time, and the last value wins ---------------------------------------------------------------------
const go = async () => {
  wanted = true;
  halted = false;
  if (running) {
    const one = running;
    clearTimeout(hurry);
    hurry = setTimeout(() => { if (running === one) worker.postMessage({ stop: true }); }, Math.max(0, began + PATIENCE - performance.now()));
    return;
  }
  while (wanted) {
    wanted = false;
    clearTimeout(hurry);
    running = runs += 1;
    began = performance.now();
    mark("busy");
    try {
      const answer = await call("move", { knobs: values, loop });
      if (answer.stopped) { if (!wanted) say("Stopped. The picture is of the last run that ended."); continue; }
      take(answer);
      say(answer.ran ? `Run in ${Math.round(answer.took)} ms.` : "These values do not run: see the findings.", !answer.ran);
      document.body.dataset.took = Math.round(performance.now() - began);
      if (!wanted) { const more = await call("margins", {}); if (!wanted) take(more); }
    } catch (error) { if (error.message !== "restarted") fail(error); }
  }
  running = 0;
  mark(model ? "idle" : "failed");
};
const halt = () => {
  if (!running || halted) return;
  halted = true;
  wanted = false;
  clearTimeout(hurry);
  worker.postMessage({ stop: true });
  const one = running;
  setTimeout(() => { if (running === one && halted) restart().catch(fail); }, LONGEST);
};
const restart = async () => {
  dropWorker();
  await start();
  say("Stopped: Python was started anew. The picture is of the last run that ended.");
};
const start = async () => {
  mark("starting");
  const from = performance.now();
  await startPython();
  if (!model) say("Running the scenario as filed …");
  const answer = await call("begin", files);
  if (model) { mark("idle"); return; }
  model = answer;
  loop = model.first;
  for (const name of names()) add($("loop"), "option", name);
  $("loop").value = loop;
  const [before, now] = model.sides;
  for (const [id, text] of [["before-title", before], ["now-title", now]]) $(id).textContent = text;
  Object.assign(last, answer);
  drawKnobs();
  take(await call("picture", { loop }));
  document.body.dataset.ready = Math.round(performance.now() - from);
  say("Ready: move a slider, or write a number.");
  mark("idle");
  take(await call("margins", {}));
};

$("loop").addEventListener("change", async () => {
  loop = $("loop").value;
  drawKnobs();
  drawSaid();
  if (!running) take(await call("picture", { loop })); else go();
});
$("stop").addEventListener("click", halt);
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && running) halt(); });
$("filed").addEventListener("click", () => { values = {}; drawKnobs(); go(); });
$("copy-yaml").addEventListener("click", () => copy(last.yaml, "The configuration"));
$("copy-words").addEventListener("click", () => copy(last.words.map((one) => [one.address, one.after, one.loop, one.field].filter(Boolean).join("\t")).join("\n"), "The words"));
start().catch((error) => { fail(error); mark("failed"); });
