"use strict";
// What every page with a worker needs: questions to it, and elements whose texts come from files.
const $ = (id) => document.getElementById(id);
const files = JSON.parse($("files").textContent);
const workerSource = URL.createObjectURL(new Blob([$("worker").textContent], { type: "text/javascript" }));
const waiting = new Map();
let worker, asked = 0;

const open = () => {
  worker = new Worker(workerSource);
  worker.onmessage = ({ data }) => {
    if (data.progress !== undefined) { $("share").value = data.progress; return; }
    const one = waiting.get(data.number);
    waiting.delete(data.number);
    if (data.error !== undefined) one?.failed(new Error(data.error, { cause: data.trace })); else one?.done({ ...data.answer, took: data.took });
  };
  worker.onerror = (event) => { for (const one of waiting.values()) one.failed(new Error(event.message || "the worker does not start")); waiting.clear(); };
};
const ask = (body) => new Promise((done, failed) => { waiting.set(++asked, { done, failed }); worker.postMessage({ ...body, number: asked }); });
const call = (name, given) => ask({ module: MODULE, name, values: given });
const startPython = () => {
  open();
  return ask({ start: { payloads: ["python", "pidcfg"].map((id) => $(id).textContent), module: MODULE } });
};
// A browser that cannot halt Python for a look at its messages gets a new worker.
const dropWorker = () => {
  worker.terminate();
  for (const one of waiting.values()) one.failed(new Error("restarted"));
  waiting.clear();
};
const say = (text, bad = false) => { $("status").textContent = text; $("status").classList.toggle("bad", bad); };
const fail = (error) => { console.info(error.cause ?? error); say(error.message.replace(/^.*?Error: /, ""), true); };
const add = (parent, tag, text = "", name = "") => {
  const element = parent.appendChild(document.createElement(tag));
  if (text !== "") element.textContent = text;
  if (name) element.className = name;
  return element;
};
const mark = (state) => {
  document.body.dataset.state = state;
  $("stop").disabled = state !== "busy";
  $("share").hidden = state !== "busy" && state !== "starting";
  $("picture").classList.toggle("waiting", state === "busy");
};
const copy = async (text, what) => {
  try { await navigator.clipboard.writeText(text); say(`${what} copied.`); } catch {
    const area = add(document.body, "textarea", text);
    area.select();
    say(document.execCommand("copy") ? `${what} copied.` : "The browser does not let a page copy: take it from the text on the page.");
    area.remove();
  }
};
