// The built extension in a fake editor, with the real server: PIDCFG_PROGRAM names the program.
"use strict";

const assert = require("node:assert/strict");
const fs = require("node:fs");
const path = require("node:path");
const test = require("node:test");

const { fake, loadWith } = require("./fake.js");

const BUILT = path.join(__dirname, "../dist/extension.js");
const EXAMPLES = path.join(__dirname, "../../../examples/dl06");
const PROGRAM = process.env.PIDCFG_PROGRAM || "pidcfg";
const PACKAGE = require("../package.json");

// An editor in which the extension is active, with an example open.
async function started(name, settings = {}) {
    const editor = fake({ "pidcfg.path": PROGRAM, ...settings });
    const extension = loadWith(editor.vscode, BUILT);
    const context = { subscriptions: [] };
    await extension.activate(context);
    if (name) {
        const file = path.join(EXAMPLES, name);
        editor.opens(file, fs.readFileSync(file, "utf8"));
    }
    return { ...editor, extension };
}

async function until(what) {
    for (let tries = 0; tries < 600; tries++) {
        const found = await what();
        if (found) {
            return found;
        }
        await new Promise((resolve) => setTimeout(resolve, 100));
    }
    return assert.fail("nothing came");
}

test("every command of the package is there", async () => {
    const { commands, shown, extension } = await started();
    assert.deepEqual(shown.errors, []);
    for (const { command } of PACKAGE.contributes.commands) {
        assert.ok(commands.has(command), command);
    }
    await extension.deactivate();
});

test("findings come from the server", async () => {
    const { published, extension } = await started("reactor.yaml");
    const found = await until(() => [...published.values()].find((rows) => rows.length > 0));
    assert.ok(found.some((one) => one.message.startsWith("bias_freeze is on")));
    await extension.deactivate();
});

test("the words of a loop are shown in a pane", async () => {
    const { commands, shown, extension } = await started("reactor.yaml");
    await until(async () => {
        await commands.get("pidcfg.showWords")();
        return shown.output.length > 0;
    });
    assert.deepEqual(shown.picks.at(-1), ["FIC-102", "TIC-101", "LIC-103"]);
    assert.match(shown.output.join(""), /V2010 +0080 +Gain/);
    await extension.deactivate();
});

test("a scenario is run", async () => {
    const { commands, shown, extension } = await started("reactor.scenario.yaml");
    await until(async () => {
        await commands.get("pidcfg.runScenario")();
        return shown.output.length > 0;
    });
    assert.match(shown.output.join(""), /passed: 4 of 4 expectations/);
    await extension.deactivate();
});

test("a program that is not there is told with what to do", async () => {
    const { shown } = await started(undefined, { "pidcfg.path": "/nowhere/pidcfg" });
    assert.match(shown.errors.at(-1), /'\/nowhere\/pidcfg lsp' does not start: .*pip install "pidcfg\[lsp\]"/);
});
