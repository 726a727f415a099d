"""A raw client of the language server: JSON-RPC over the pipes of a process, as an editor speaks."""

from __future__ import annotations

import json
import subprocess
import sys
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Self

COMMAND = (sys.executable, "-m", "pidcfg", "lsp")
PATIENCE = 120
"""Seconds until an answer must have come."""


class Client:
    """An editor that has started the server."""

    def __init__(
        self, *folders: Any, command: tuple[str, ...] = COMMAND, able: Any = None, options: Any = None
    ) -> None:
        self.asked = 0
        self.findings: dict[str, tuple[int | None, list]] = {}
        """What was published last of each file, with the version."""
        self.shown: list[str] = []
        self.messages: SimpleQueue[dict | None] = SimpleQueue()
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(command, **pipes)
        Thread(target=self.listen, daemon=True).start()
        roots = [{"uri": folder.as_uri(), "name": folder.name} for folder in folders]
        told = {"processId": None, "rootUri": None, "capabilities": able or {}, "workspaceFolders": roots}
        self.able = self.ask("initialize", {**told, "initializationOptions": options})["capabilities"]
        self.tell("initialized", {})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.ask("shutdown", None)
        self.tell("exit", None)
        code = self.process.wait(timeout=PATIENCE)
        self.process.stdin.close()
        self.process.stdout.close()
        assert code == 0

    def open(self, uri: str, text: str, version: int = 1) -> None:
        """A file is opened."""
        self.tell(
            "textDocument/didOpen",
            {"textDocument": {"uri": uri, "languageId": "yaml", "version": version, "text": text}},
        )

    def change(self, uri: str, text: str, version: int) -> None:
        """Somebody has typed."""
        place = {"uri": uri, "version": version}
        self.tell("textDocument/didChange", {"textDocument": place, "contentChanges": [{"text": text}]})

    def found(self, uri: str, version: int = 1) -> list[dict]:
        """The findings of a file in a version, as soon as they come."""
        while self.findings.get(uri, (None, []))[0] != version:
            self.take(self.read())
        return self.findings[uri][1]

    def ask(self, method: str, params: Any) -> Any:
        """The result of a request."""
        answer = self.answer(method, params)
        assert "error" not in answer, answer["error"]
        return answer["result"]

    def at(self, method: str, uri: str, line: int, character: int, **more: Any) -> Any:
        """The result of a request about a place, from 0."""
        place = {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}
        return self.ask(f"textDocument/{method}", {**place, **more})

    def answer(self, method: str, params: Any) -> dict:
        """The answer to a request, an error too."""
        self.asked += 1
        self.send(id=self.asked, method=method, params=params)
        while (message := self.read()).get("id") != self.asked or "method" in message:
            self.take(message)
        return message

    def tell(self, method: str, params: Any) -> None:
        """A notification."""
        self.send(method=method, params=params)

    def take(self, message: dict) -> None:
        """What the server says by itself."""
        params = message.get("params") or {}
        if message.get("method") == "textDocument/publishDiagnostics":
            self.findings[params["uri"]] = params.get("version"), params["diagnostics"]
        elif message.get("method") == "window/showMessage":
            self.shown.append(params["message"])
        elif "id" in message:
            self.send(id=message["id"], result=None)

    def send(self, **message: object) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def read(self) -> dict:
        """The next message."""
        try:
            message = self.messages.get(timeout=PATIENCE)
        except Empty:
            raise AssertionError("the server says nothing") from None
        assert message is not None, "the server has ended"
        return message

    def listen(self) -> None:
        """Takes what the server says as it says it."""
        while header := self.process.stdout.readline():
            while line := self.process.stdout.readline().strip():
                header = header if header.lower().startswith(b"content-length") else line
            self.messages.put(json.loads(self.process.stdout.read(int(header.partition(b":")[2]))))
        self.messages.put(None)
