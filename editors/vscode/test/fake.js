// A small fake of the module `vscode`: as much of an editor as the extension and its language client ask for.
"use strict";

const Module = require("node:module");
const path = require("node:path");

class Emitter {
    constructor() {
        this.listeners = new Set();
        this.event = (listener, self) => {
            const bound = self ? listener.bind(self) : listener;
            this.listeners.add(bound);
            return { dispose: () => this.listeners.delete(bound) };
        };
    }
    fire(value) {
        for (const listener of [...this.listeners]) {
            listener(value);
        }
    }
    dispose() {
        this.listeners.clear();
    }
}

class Disposable {
    constructor(dispose) {
        this.dispose = dispose || (() => undefined);
    }
    static from(...several) {
        return new Disposable(() => several.forEach((one) => one.dispose()));
    }
}

class Uri {
    constructor(text) {
        this.text = text;
        const url = new URL(text);
        this.scheme = url.protocol.slice(0, -1);
        this.path = decodeURIComponent(url.pathname);
        this.fsPath = this.path;
        this.authority = this.query = this.fragment = "";
    }
    static parse(text) {
        return new Uri(text);
    }
    static file(name) {
        return new Uri(require("node:url").pathToFileURL(path.resolve(name)).href);
    }
    with() {
        return this;
    }
    toString() {
        return this.text;
    }
}

class Position {
    constructor(line, character) {
        Object.assign(this, { line, character });
    }
}

class Range {
    constructor(a, b, c, d) {
        [this.start, this.end] = c === undefined ? [a, b] : [new Position(a, b), new Position(c, d)];
    }
}

class CodeActionKind {
    constructor(value) {
        this.value = value;
    }
    append(part) {
        return new CodeActionKind(this.value ? `${this.value}.${part}` : part);
    }
}
CodeActionKind.Empty = new CodeActionKind("");

class CancellationTokenSource {
    constructor() {
        this.token = { isCancellationRequested: false, onCancellationRequested: new Emitter().event };
    }
    cancel() {}
    dispose() {}
}

// An editor with settings; what it is told is kept in `shown`, `published`, `commands` and `output`.
function fake(settings) {
    const shown = { errors: [], infos: [], picks: [], output: [] };
    const published = new Map();
    const commands = new Map();
    const events = {};
    const event = (name) => (events[name] = events[name] || new Emitter()).event;
    const documents = [];
    const providers = { lenses: [] };
    const nothing = () => new Disposable();
    const channel = () => ({
        append: (text) => shown.output.push(text),
        appendLine: () => undefined,
        clear: () => shown.output.splice(0),
        show: () => undefined,
        dispose: () => undefined,
        trace: () => undefined, debug: () => undefined, info: () => undefined, warn: () => undefined,
        error: () => undefined, logLevel: 3, onDidChangeLogLevel: new Emitter().event, replace: () => undefined,
    });
    const section = (name) => ({
        get: (key, otherwise) => settings[name ? `${name}.${key}` : key] ?? otherwise,
        has: () => false,
        inspect: () => undefined,
        update: () => Promise.resolve(),
    });
    const own = {
        version: "1.95.0",
        Uri, Position, Range, Disposable, CodeActionKind, CancellationTokenSource,
        EventEmitter: Emitter,
        Location: class { constructor(uri, range) { Object.assign(this, { uri, range }); } },
        Diagnostic: class { constructor(range, message, severity) { Object.assign(this, { range, message, severity }); } },
        CodeLens: class { constructor(range, command) { Object.assign(this, { range, command }); } },
        env: { appName: "fake", language: "en", logLevel: 3, onDidChangeLogLevel: new Emitter().event },
        workspace: {
            getConfiguration: section,
            workspaceFolders: undefined,
            textDocuments: documents,
            notebookDocuments: [],
            isTrusted: true,
            fs: {},
            createFileSystemWatcher: () => ({ ...new Disposable(), onDidCreate: nothing, onDidChange: nothing, onDidDelete: nothing, dispose() {} }),
            asRelativePath: (uri) => String(uri),
            getWorkspaceFolder: () => undefined,
        },
        window: {
            activeTextEditor: undefined,
            visibleTextEditors: [],
            state: { focused: true },
            tabGroups: { all: [], onDidChangeTabs: nothing, onDidChangeTabGroups: nothing },
            createOutputChannel: channel,
            showErrorMessage: (text) => { shown.errors.push(text); return Promise.resolve(); },
            showWarningMessage: (text) => { shown.errors.push(text); return Promise.resolve(); },
            showInformationMessage: (text) => { shown.infos.push(text); return Promise.resolve(); },
            showQuickPick: (names) => { shown.picks.push(names); return Promise.resolve(names[0]); },
            withProgress: (_, task) => task({ report() {} }, new CancellationTokenSource().token),
        },
        languages: {
            match: () => 10,
            createDiagnosticCollection: () => ({
                set: (uri, found) => published.set(String(uri), found),
                delete: (uri) => published.delete(String(uri)),
                has: (uri) => published.has(String(uri)), get: (uri) => published.get(String(uri)),
                clear: () => published.clear(), dispose: () => published.clear(), forEach: () => undefined,
            }),
            registerCodeLensProvider: (_, provider) => { providers.lenses.push(provider); return new Disposable(); },
        },
        commands: {
            registerCommand: (name, call) => { commands.set(name, call); return new Disposable(() => commands.delete(name)); },
            executeCommand: async (name, ...rest) => {
                if (name === "vscode.executeCodeLensProvider") {
                    const document = documents.find((one) => String(one.uri) === String(rest[0]));
                    const token = new CancellationTokenSource().token;
                    const found = await Promise.all(providers.lenses.map((one) => one.provideCodeLenses(document, token)));
                    return found.flat().filter(Boolean);
                }
                return commands.has(name) ? commands.get(name)(...rest) : undefined;
            },
        },
    };
    // What nobody here has thought of: an event, a registration, a class, a set of numbers.
    const open = (object, name) => new Proxy(object, {
        get(target, key) {
            if (key in target || typeof key === "symbol") {
                return target[key];
            }
            if (/^on(Did|Will)/.test(key)) {
                return event(`${name}.${key}`);
            }
            return /^register|^create/.test(key) ? nothing : undefined;
        },
    });
    for (const name of ["workspace", "window", "languages", "commands"]) {
        own[name] = open(own[name], name);
    }
    const numbers = new Proxy({}, { get: (_, key) => (typeof key === "string" ? key.length : undefined) });
    const vscode = new Proxy(own, {
        get(target, key) {
            if (key in target || typeof key === "symbol") {
                return target[key];
            }
            const made = class {
                constructor(...rest) { Object.assign(this, { rest }); }
            };
            const flags = new Set(["prototype", "name", "length"]);
            target[key] = new Proxy(made, {
                get: (one, inner) => (inner in one || flags.has(inner) || typeof inner === "symbol" ? one[inner] : numbers[inner]),
            });
            return target[key];
        },
    });
    function opens(name, text, version = 1) {
        const uri = Uri.file(name);
        const document = {
            uri, languageId: "yaml", version, fileName: uri.fsPath, isDirty: false, isClosed: false,
            getText: () => text, lineCount: text.split("\n").length,
        };
        documents.push(document);
        own.window.activeTextEditor = { document };
        (events["workspace.onDidOpenTextDocument"] || new Emitter()).fire(document);
        return document;
    }
    return { vscode, shown, published, commands, opens };
}

// Loads a file for which `vscode` is the fake.
function loadWith(vscode, file) {
    const before = Module._load;
    Module._load = function (name, ...rest) {
        return name === "vscode" ? vscode : before.call(this, name, ...rest);
    };
    try {
        delete require.cache[require.resolve(file)];
        return require(file);
    } finally {
        Module._load = before;
    }
}

module.exports = { fake, loadWith };
