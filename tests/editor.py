"""What an editor sees: regular expressions as JavaScript has them, and files as yaml-language-server marks them.

Both are programs for Node. Where they are not installed the tests that ask for them skip and say so.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Self

import pytest

NODE = shutil.which("node") or shutil.which("nodejs")
SERVER = Path(__file__).parent / "node/node_modules/yaml-language-server/bin/yaml-language-server"
needs_node = pytest.mark.skipif(NODE is None, reason="node is not installed")
needs_server = pytest.mark.skipif(
    NODE is None or not SERVER.exists(),
    reason="yaml-language-server is not installed: npm ci --ignore-scripts in tests/node",
)
MATCH = """
const [patterns, texts] = JSON.parse(require("fs").readFileSync(0, "utf8"));
const fitting = (pattern) => {
    try {
        const form = new RegExp(pattern, "u");
        return texts.filter((text) => form.test(text));
    } catch (error) {
        return String(error);
    }
};
console.log(JSON.stringify(patterns.map(fitting)));
"""


def in_node(patterns: list[str], texts: list[str]) -> dict[str, set[str] | str]:
    """The texts that each pattern fits, by pattern; of one that is no regular expression the error."""
    told = subprocess.run(
        [str(NODE), "-e", MATCH], input=json.dumps([patterns, texts]).encode(), capture_output=True, check=True
    )
    found = zip(patterns, json.loads(told.stdout), strict=True)
    return {pattern: fits if isinstance(fits, str) else set(fits) for pattern, fits in found}


class LanguageServer:
    """yaml-language-server for a folder, with patterns of the files of each schema; it downloads nothing."""

    def __init__(self, folder: Path, schemas: dict[str, list[str]]) -> None:
        self.settings = {"yaml": {"schemas": schemas, "schemaStore": {"enable": False}}}
        self.told = False
        """Whether it has its settings: a file that is opened earlier would be looked at without a schema."""
        self.found: dict[str, list] = {}
        self.asked = 0
        self.messages: SimpleQueue[dict | None] = SimpleQueue()
        command = [str(NODE), str(SERVER), "--stdio"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.listener = Thread(target=self.listen, daemon=True)
        self.listener.start()
        able = {"workspace": {"configuration": True, "workspaceFolders": True}}
        root = {"rootUri": folder.as_uri(), "workspaceFolders": [{"uri": folder.as_uri(), "name": folder.name}]}
        self.ask("initialize", {"processId": None, "capabilities": able, **root})
        self.send(method="initialized", params={})
        self.send(method="workspace/didChangeConfiguration", params={"settings": {}})
        while not self.told:
            self.answer(self.read())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.ask("shutdown", None)
        self.send(method="exit", params=None)
        self.listener.join(timeout=60)
        self.process.__exit__(None, None, None)

    def diagnostics(self, texts: dict[str, str]) -> dict[str, list]:
        """What it marks in texts, by their URIs."""
        for uri, text in texts.items():
            document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
            self.send(method="textDocument/didOpen", params={"textDocument": document})
        while not texts.keys() <= self.found.keys():
            self.answer(self.read())
        return {uri: self.found[uri] for uri in texts}

    def ask(self, method: str, params: object) -> object:
        """The answer to a request."""
        self.asked += 1
        self.send(id=self.asked, method=method, params=params)
        while (message := self.read()).get("id") != self.asked or "method" in message:
            self.answer(message)
        return message["result"]

    def answer(self, message: dict) -> None:
        """Takes what the server publishes, and gives the settings that it asks for."""
        if message["method"] == "textDocument/publishDiagnostics":
            self.found[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif "id" in message:
            items = message["params"].get("items", ())
            self.send(id=message["id"], result=[self.settings.get(item["section"]) for item in items])
            self.told = self.told or message["method"] == "workspace/configuration"

    def send(self, **message: object) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def read(self) -> dict:
        """The next message."""
        return self.messages.get(timeout=300) or pytest.fail("yaml-language-server has ended")

    def listen(self) -> None:
        """Takes what the server says as it says it: a server that nobody listens to would wait, and so would we."""
        while header := self.process.stdout.readline():
            self.process.stdout.readline()
            self.messages.put(json.loads(self.process.stdout.read(int(header.partition(b":")[2]))))
        self.messages.put(None)
