// Puts into the extension what the repository has already: the licence, the schema of scenarios, starters as snippets.
"use strict";

const fs = require("node:fs");
const path = require("node:path");

const HERE = __dirname;
const ROOT = path.join(HERE, "../..");
const STARTERS = path.join(ROOT, "src/pidcfg/cli/starters");

function snippets() {
    const found = {};
    for (const file of fs.readdirSync(STARTERS).sort()) {
        const vendor = path.basename(file, ".yaml");
        const text = fs.readFileSync(path.join(STARTERS, file), "utf8").trimEnd();
        found[`pidcfg ${vendor}`] = {
            prefix: `pidcfg-${vendor}`,
            description: `A first file of loops for ${vendor}, as 'pidcfg init --vendor ${vendor}' writes it`,
            body: text.replace(/[\\$}]/g, "\\$&").split("\n"),
        };
    }
    return found;
}

for (const folder of ["schemas", "snippets"]) {
    fs.mkdirSync(path.join(HERE, folder), { recursive: true });
}
fs.copyFileSync(path.join(ROOT, "LICENSE"), path.join(HERE, "LICENSE"));
const schema = "schemas/scenario.schema.json";
fs.copyFileSync(path.join(ROOT, "docs", schema), path.join(HERE, schema));
fs.writeFileSync(path.join(HERE, "snippets/pidcfg.json"), JSON.stringify(snippets(), null, 2) + "\n");
