// Compiles Python's library, the wheels and pidcfg with the Python that will run them in the browser.
// node compile.mjs PYODIDE WORK: WORK holds wheels/*.whl and source/ (pidcfg's folder); stdlib.zip, site.zip, core.zip
// and compiled/<SHA-256 of a module>.pyc are written beside them.
import { readFileSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [pyodide, work] = process.argv.slice(2).map((name) => path.resolve(name));
const { loadPyodide } = await import(pathToFileURL(path.join(pyodide, "pyodide.mjs")));
const python = await loadPyodide({ indexURL: pyodide + path.sep });
python.FS.mkdirTree("/work");
python.FS.mount(python.FS.filesystems.NODEFS, { root: work }, "/work");
python.FS.mkdirTree("/library");
python.FS.writeFile("/library/python_stdlib.zip", readFileSync(path.join(pyodide, "python_stdlib.zip")));
python.runPython(readFileSync(new URL("compile.py", import.meta.url), "utf-8"));
