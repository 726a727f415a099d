"use strict";
// The playground: two texts on the left, what pidcfg says of them on the right. Texts are set as text; pictures are HTML
// that pidcfg has made and escaped.
const MODULE = "pidcfg.output.browser.playground", PAUSE = 250, LONGEST = 2500;
const PANES = ["config", "scenario"], RESULTS = ["findings", "words", "trend", "convert", "explain"];
let pane = "config", shown = "findings", texts = { config: "", scenario: "" }, names = { config: "", scenario: "" }, others = {};
let judged = { findings: [], words: "" }, running = false, wanted = false, timer, began = 0;

// --- the editor: line numbers that tell where findings are ------------------------------------------------------------
const drawGutter = () => {
  const gutter = $("gutter"), worst = new Map();
  for (const one of judged.findings) if (one.pane === pane && worst.get(one.line) !== "error") worst.set(one.line, one.severity);
  gutter.textContent = "";
  texts[pane].split("\n").forEach((_, i) => add(gutter, "div", worst.has(i + 1) ? `● ${i + 1}` : `${i + 1}`, worst.get(i + 1) ?? ""));
  gutter.scrollTop = $("text").scrollTop;
};
const show = (name) => {
  pane = name;
  for (const one of PANES) $(`tab-${one}`).setAttribute("aria-selected", one === name);
  $("pane").setAttribute("aria-labelledby", `tab-${name}`);
  $("text").setAttribute("aria-label", $(`tab-${name}`).textContent);
  $("text").value = texts[name];
  drawGutter();
};
const goTo = (finding) => {
  if (finding.pane !== pane) show(finding.pane);
  const lines = texts[pane].split("\n"), at = lines.slice(0, finding.line - 1).reduce((sum, line) => sum + line.length + 1, 0);
  const area = $("text");
  area.focus();
  area.setSelectionRange(at + finding.column - 1, at + (lines[finding.line - 1] ?? "").length);
  area.scrollTop = Math.max(0, (finding.line - 8) * parseFloat(getComputedStyle(area).lineHeight));
};

// --- what pidcfg says -------------------------------------------------------------------------------------------------
const given = () => ({ files: { ...others, [names.config]: texts.config, [names.scenario]: texts.scenario }, config: names.config, scenario: names.scenario });
const drawFindings = () => {
  const list = $("findings");
  list.textContent = "";
  for (const one of judged.findings) {
    const item = add(list, "li", "", one.severity), link = add(item, "button");
    link.type = "button";
    add(link, "b", `${one.pane === "config" ? "" : "scenario "}${one.line}:${one.column} ${one.severity} ${one.code} `);
    add(link, "span", `${one.message}${one.loop ? ` [${one.loop}]` : ""}`);
    link.addEventListener("click", () => goTo(one));
    for (const [title, text] of [["PLC", one.effect], ["see", one.reference], ["cure", one.help]]) if (text) add(item, "p", `${title}: ${text}`, "soft");
  }
  $("no-findings").hidden = judged.findings.length > 0;
  $("words").textContent = judged.words || "There are no words: see the findings.";
  const errors = judged.findings.filter((one) => one.severity === "error").length;
  $("tab-findings").textContent = `Findings (${judged.findings.length}${errors ? `, ${errors} of them errors` : ""})`;
};
const WORK = {
  trend: async () => {
    const answer = await call("trend", given());
    if (answer.stopped) { say("Stopped."); return; }
    $("verdicts").textContent = "";
    for (const one of answer.verdicts) { const item = add($("verdicts"), "li"); add(item, "b", `${one.loop} ${one.verdict}`); add(item, "span", one.missing ? `: ${one.missing}` : ""); }
    $("picture").innerHTML = answer.picture || "<p class=soft>Nothing ran: see the findings.</p>";
    $("picture").querySelectorAll("figure").forEach(enliven);
  },
  convert: async () => {
    const answer = await call("convert", { ...given(), to: $("to").value });
    $("refused").textContent = answer.refused;
    $("converted").textContent = answer.text;
    $("change-rows").textContent = "";
    for (const one of answer.changes) {
      const row = add($("change-rows"), "tr");
      for (const text of [`${one.loop} ${one.field}`, `${one.source || "–"} → ${one.target || "–"}`, [one.loss ? "loss:" : "", one.kind, one.note].filter(Boolean).join(" ")]) add(row, "td", text);
    }
    $("changes").hidden = !answer.changes.length;
  },
  explain: async () => {
    const answer = await call("explain", { ...given(), asked: $("asked").value });
    $("explained").textContent = answer.refused || answer.pages.join("\n\n");
  },
};
// One round at a time, of the newest texts; a run that is no longer wanted is stopped.
const go = async () => {
  wanted = true;
  if (running) { worker.postMessage({ stop: true }); return; }
  running = true;
  while (wanted) {
    wanted = false;
    began = performance.now();
    mark("busy");
    try {
      judged = await call("judge", given());
      drawFindings();
      drawGutter();
      if (!wanted && WORK[shown]) await WORK[shown]();
      if (!wanted && !$("status").textContent.startsWith("Stopped")) say(`Done in ${Math.round(performance.now() - began)} ms.`);
    } catch (error) { if (error.message !== "restarted") fail(error); }
  }
  running = false;
  mark("idle");
};
const later = () => { clearTimeout(timer); timer = setTimeout(() => { say(""); go(); }, PAUSE); };
const open_ = (name) => {
  shown = name;
  for (const one of RESULTS) { $(`tab-${one}`).setAttribute("aria-selected", one === name); $(`${one}-panel`).hidden = one !== name; }
  if (document.body.dataset.state !== "starting") { say(""); go(); }
};
const halt = async () => {
  if (!running) return;
  worker.postMessage({ stop: true });
  const one = began;
  setTimeout(async () => {
    if (!running || began !== one) return;
    dropWorker();
    mark("starting");
    try { await startPython(); await call("begin", {}); say("Stopped: Python was started anew."); mark("idle"); } catch (error) { fail(error); }
  }, LONGEST);
};

// --- examples, and texts in the address -------------------------------------------------------------------------------
const take = (example) => {
  names = { config: example.config, scenario: example.scenario };
  others = { ...example.files };
  for (const one of PANES) { texts[one] = example.files[names[one]] ?? ""; delete others[names[one]]; }
  show("config");
};
const squeeze = async (text) => {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return btoa(Array.from(bytes, (one) => String.fromCharCode(one)).join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
};
const unsqueeze = async (text) => {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).text();
};
const fromAddress = async () => {
  const found = location.hash.match(/^#t=([-\w]+)$/);
  if (!found) return false;
  try {
    const shared = JSON.parse(await unsqueeze(found[1])), [config, scenario] = [String(shared.names[0]), String(shared.names[1])];
    take({ config, scenario, files: Object.fromEntries(Object.entries(shared.files).map(([name, text]) => [name, String(text)])) });
    const named = files.examples.findIndex((one) => one.config === config && one.scenario === scenario);
    if (named >= 0) $("example").value = named;
    return true;
  } catch { say("The address holds no texts that can be read.", true); return false; }
};
const start = async () => {
  mark("starting");
  for (const [i, one] of files.examples.entries()) { const option = add($("example"), "option", one.title); option.value = i; }
  if (!await fromAddress()) {
    const first = Math.max(0, files.examples.findIndex((one) => one.config === files.first));
    $("example").value = first;
    take(files.examples[first]);
  }
  open_("findings");
  await startPython();
  const begun = await call("begin", {});
  for (const one of begun.vendors) { const option = add($("to"), "option", one.title); option.value = one.key; }
  $("to").value = "click";
  mark("idle");
  say("Ready.");
  await go();
};

$("text").addEventListener("input", () => { texts[pane] = $("text").value; drawGutter(); later(); });
$("text").addEventListener("scroll", () => { $("gutter").scrollTop = $("text").scrollTop; });
$("example").addEventListener("change", () => { take(files.examples[Number($("example").value)]); history.replaceState(null, "", "#"); later(); });
for (const one of PANES) $(`tab-${one}`).addEventListener("click", () => show(one));
for (const one of RESULTS) $(`tab-${one}`).addEventListener("click", () => open_(one));
for (const list of document.querySelectorAll("[role=tablist]")) list.addEventListener("keydown", (event) => {
  const tabs = [...list.querySelectorAll("[role=tab]")], way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!way) return;
  const next = tabs[(tabs.indexOf(document.activeElement) + way + tabs.length) % tabs.length];
  next.focus();
  next.click();
});
$("to").addEventListener("change", later);
$("ask").addEventListener("click", later);
$("asked").addEventListener("keydown", (event) => { if (event.key === "Enter") later(); });
$("stop").addEventListener("click", halt);
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && running) halt(); });
$("share-link").addEventListener("click", async () => {
  const packed = await squeeze(JSON.stringify({ names: [names.config, names.scenario], files: given().files }));
  history.replaceState(null, "", `#t=${packed}`);
  copy(location.href, "The link");
});
window.addEventListener("hashchange", async () => { if (await fromAddress()) later(); });
start().catch((error) => { fail(error); mark("failed"); });
