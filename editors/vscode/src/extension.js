// Starts `pidcfg lsp`, and shows what it answers to the commands above the text.
"use strict";

const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

const RUN = "pidcfg.run";
const WORDS = "pidcfg.words";
const INSTALL = 'install it by pip install "pidcfg[lsp]", or say in the setting pidcfg.path where it is';

let client;

// The server's commands give texts, which go to a pane of their own.
function middleware(output) {
    return {
        executeCommand: async (command, args, next) => {
            const text = await next(command, args);
            if (typeof text === "string") {
                output.clear();
                output.append(text);
                output.show(true);
            }
            return text;
        },
    };
}

// What stands above the text of a file: the commands that the server offers there.
async function lenses(command) {
    const editor = vscode.window.activeTextEditor;
    if (!editor) {
        return [];
    }
    const found = await vscode.commands.executeCommand("vscode.executeCodeLensProvider", editor.document.uri, 1000);
    return (found || []).map((lens) => lens.command).filter((one) => one && one.command === command);
}

async function runScenario() {
    const [first] = await lenses(RUN);
    if (!first) {
        vscode.window.showInformationMessage("pidcfg: this file is no scenario");
        return;
    }
    await vscode.commands.executeCommand(first.command, ...first.arguments);
}

async function showWords() {
    const found = await lenses(WORDS);
    if (found.length === 0) {
        vscode.window.showInformationMessage("pidcfg: this file has no loops that can be encoded");
        return;
    }
    const names = found.map((one) => one.arguments[1]);
    const name = names.length === 1 ? names[0] : await vscode.window.showQuickPick(names);
    const chosen = found[names.indexOf(name)];
    if (chosen) {
        await vscode.commands.executeCommand(chosen.command, ...chosen.arguments);
    }
}

async function activate(context) {
    const settings = vscode.workspace.getConfiguration("pidcfg");
    const command = settings.get("path", "pidcfg");
    const output = vscode.window.createOutputChannel("pidcfg");
    const server = { command, args: ["lsp"] };
    client = new LanguageClient("pidcfg", "pidcfg", server, {
        documentSelector: [{ language: "yaml" }],
        initializationOptions: { inlayHints: settings.get("inlayHints", true) },
        middleware: middleware(output),
    });
    context.subscriptions.push(
        output,
        vscode.commands.registerCommand("pidcfg.runScenario", runScenario),
        vscode.commands.registerCommand("pidcfg.showWords", showWords),
    );
    try {
        await client.start();
    } catch (error) {
        vscode.window.showErrorMessage(`pidcfg: '${command} lsp' does not start: ${error.message}; ${INSTALL}`);
    }
}

function deactivate() {
    return client && client.isRunning() ? client.stop() : undefined;
}

module.exports = { activate, deactivate };
