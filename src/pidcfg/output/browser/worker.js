"use strict";
// Python in a worker of a page that was opened from a disk: no server, no network. A module worker does not start from
// file://, and Pyodide refuses a classic one by its importScripts: this one refuses that itself, and imports modules
// from blobs. Whatever Pyodide fetches comes from the parts that the page carries.
self.importScripts = () => { throw new TypeError("modules are imported"); };
const HOME = "https://pidcfg.invalid/", LOOK_EVERY = 60;
const HALTS = typeof WebAssembly.Suspending === "function";
let parts = {}, python, call, stopped = false, looked = 0;

const bytesOf = (text) => Uint8Array.fromBase64 ? Uint8Array.fromBase64(text) : Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const unpack = async (text) => {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
  const data = await new Response(stream).arrayBuffer();
  const length = new DataView(data).getUint32(0), rows = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let at = 4 + length;
  return Object.fromEntries(rows.map(([name, size]) => [name, new Uint8Array(data, (at += size) - size, size)]));
};
self.fetch = async (address) => {
  const name = String(address.url ?? address).split("?")[0].replace(HOME, "");
  if (!(name in parts)) throw new TypeError(`${name} is no part of the page`);
  const type = name.endsWith(".wasm") ? "application/wasm" : "application/octet-stream";
  return new Response(parts[name], { headers: { "content-type": type } });
};
const load = (name) => import(URL.createObjectURL(new Blob([parts[name]], { type: "text/javascript" })));

// While Python runs it looks here now and then, where the browser can halt it meanwhile: messages come in then.
self.pidcfgLook = (share) => {
  const now = performance.now();
  if (now - looked < LOOK_EVERY) return undefined;
  looked = now;
  postMessage({ progress: share });
  return new Promise((go) => { const way = new MessageChannel(); way.port1.onmessage = () => go(stopped); way.port2.postMessage(0); });
};

const BEGIN = `
import json, sys
sys.path[:0] = ["/pidcfg", "/core", "/site.zip"]
sys.dont_write_bytecode = True
import os
os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"
from js import pidcfgLook
from pyodide.ffi import can_run_sync, run_sync

class Stopped(Exception):
    """The person has asked for an end, or for something newer."""

def progress(share):
    waiting = pidcfgLook(share)
    if waiting is not None and can_run_sync() and run_sync(waiting):
        raise Stopped

def call(module, name, text):
    from importlib import import_module
    try:
        return json.dumps(getattr(import_module(module), name)(json.loads(text), progress))
    except Stopped:
        return json.dumps({"stopped": True})
`;

const start = async ({ payloads, module }) => {
  const begin = performance.now();
  parts = Object.assign({}, ...await Promise.all(payloads.map(unpack)));
  const unpacked = performance.now();
  const [{ loadPyodide }, core] = [await load("pyodide.mjs"), await load("pyodide.asm.mjs")];
  python = await loadPyodide({
    indexURL: HOME, packageBaseUrl: HOME, stdLibURL: `${HOME}stdlib.zip`, createPyodideModule: core.default,
    lockFileContents: JSON.parse(new TextDecoder().decode(parts["pyodide-lock.json"])),
  });
  python.FS.writeFile("/site.zip", parts["site.zip"]);
  for (const name of ["core", "pidcfg"]) python.unpackArchive(parts[`${name}.zip`], "zip", { extractDir: `/${name}` });
  parts = {};
  python.runPython(BEGIN);
  call = python.globals.get("call");
  python.runPython(`import ${module}`);
  const ready = performance.now();
  return { unpacked: unpacked - begin, python: ready - unpacked };
};

// The line of a traceback that says what is wrong; Python explains missing modules below it.
const lastError = (text) => text.split("\n").filter((line) => /^[\w.]*(Error|Exception)\b/.test(line)).pop() ?? text.trim().split("\n").pop();

// One call after the other; one that asks for a stop is seen by the one that runs.
let queue = Promise.resolve();
self.onmessage = ({ data }) => {
  if (data.stop) { stopped = true; return; }
  queue = queue.then(async () => {
    const begin = performance.now();
    stopped = false;
    try {
      const answer = data.start ? await start(data.start)
        : JSON.parse(await (HALTS ? call.callPromising(data.module, data.name, JSON.stringify(data.values)) : call(data.module, data.name, JSON.stringify(data.values))));
      postMessage({ number: data.number, answer, took: performance.now() - begin });
    } catch (error) {
      postMessage({ number: data.number, error: lastError(String(error.message ?? error)), trace: String(error.stack ?? error) });
    }
  });
};
