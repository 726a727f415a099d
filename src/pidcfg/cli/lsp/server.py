"""The language server itself: which request gets which answer, and one worker that looks at files as they change.

What answers is imported when it is asked for, so that the editor hears at once that somebody is there.
"""

from __future__ import annotations

import asyncio
import gc
import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidRequest
from pygls.lsp.server import LanguageServer

from pidcfg.about import VERSION
from pidcfg.cli.lsp import RUN_COMMAND, WORDS_COMMAND
from pidcfg.cli.lsp.files import Analysis, Files, path_of, runs_configuration

SERVER_NAME = "pidcfg"
INLAY_HINTS_OPTION = "inlayHints"
"""The one setting, among the options of initialisation: whether words stand beside values."""
GC_THRESHOLD = 50_000
"""Objects after which the garbage collector looks again: a file of 300 loops has as many."""


class Server(LanguageServer):
    """A server for one editor."""

    def __init__(self) -> None:
        super().__init__(SERVER_NAME, VERSION, types.TextDocumentSyncKind.Full)
        self.files = Files()
        self.resolves_edits = False
        """Whether the editor asks for the edit of an action when somebody wants it."""
        self.has_hints = True
        self.pool = ThreadPoolExecutor(1)
        self.analyses: dict[str, Analysis] = {}
        self.tasks: dict[str, asyncio.Future[Analysis]] = {}
        self.published_versions: dict[str, int] = {}
        """Of each file the version whose findings the editor has."""
        self.remarks: dict[str, str] = {}
        """What was said last of the settings of a file."""

    # --- The worker ---------------------------------------------------------------------------------------------------

    async def analysis(self, uri: str) -> Analysis:
        """What is found in a buffer as it is now; while that is worked out a newer version may come, which counts."""
        while True:
            latest, entry = self.analyses.get(uri), self.files.buffers.get(uri)
            if entry is None:
                raise JsonRpcInvalidRequest(f"{uri} is not open")
            if latest is not None and latest.version == entry.version and latest.buffer is entry.buffer:
                return latest
            if uri not in self.tasks:
                loop = asyncio.get_running_loop()
                self.tasks[uri] = loop.run_in_executor(self.pool, self.files.analyse, uri)
            task = self.tasks[uri]
            try:
                self.analyses[uri] = await asyncio.shield(task)
            finally:
                if task.done() and self.tasks.get(uri) is task:
                    del self.tasks[uri]

    async def run_in_worker(self, call: Callable[..., object], *args: object, **kwargs: object) -> Any:
        """The result of something that takes a while, from the worker."""
        return await asyncio.get_running_loop().run_in_executor(self.pool, lambda: call(*args, **kwargs))

    async def publish(self, uri: str) -> None:
        """Tells the editor what is found in a buffer, once a version."""
        from pidcfg.cli.lsp import answers

        try:
            analysis = await self.analysis(uri)
        except JsonRpcInvalidRequest:
            return  # closed meanwhile
        if self.published_versions.get(uri) == analysis.version:
            return
        self.published_versions[uri] = analysis.version
        diagnostics = answers.diagnostics(analysis)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, diagnostics, analysis.version))
        if analysis.remark != self.remarks.get(uri, ""):
            self.remarks[uri] = analysis.remark
            if analysis.remark:
                self.window_show_message(types.ShowMessageParams(types.MessageType.Warning, analysis.remark))

    async def refresh(self, uri: str) -> None:
        """After a change: the findings of the file, and then those of the scenarios that may run it."""
        await self.publish(uri)
        for other, analysis in list(self.analyses.items()):
            if other != uri and runs_configuration(analysis.document, path_of(uri), self.files.reader):
                self.forget(other)
                await self.publish(other)

    async def refresh_all(self) -> None:
        """After a change of files that no buffer has, settings among them: everything is looked at again."""
        for uri in list(self.files.buffers):
            self.forget(uri)
            await self.publish(uri)

    def forget(self, uri: str) -> None:
        """What was found in a buffer no longer counts, since another file has changed."""
        self.analyses.pop(uri, None)
        self.published_versions.pop(uri, None)


def create_server() -> Server:
    """The server with all its answers."""
    server = Server()
    _register_file_events(server)
    _register_queries(server)
    _register_edits(server)
    _register_commands(server)
    return server


def set_collector() -> None:
    """Python looks for cycles seldom: there are hardly any, and a large file makes it look through everything."""
    gc.set_threshold(GC_THRESHOLD, 20, 50)


def start_server() -> None:
    """Serves an editor over standard input and output, until it says that this is the end.

    The server has standard output for itself, and closes it; what is printed meanwhile goes to standard error.
    """
    set_collector()
    stdout = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    with redirect_stdout(sys.stderr):
        create_server().start_io(stdout=stdout)


# --- Files come, change and go ----------------------------------------------------------------------------------------


def _register_file_events(server: Server) -> None:
    @server.feature(types.INITIALIZE)
    def initialize(ls: Server, params: types.InitializeParams) -> None:
        folders = [folder.uri for folder in params.workspace_folders or ()] or [params.root_uri or ""]
        ls.files.folders = [path_of(uri) for uri in folders if uri]
        encoding = ls.workspace.position_encoding or types.PositionEncodingKind.Utf16
        ls.files.encoding = types.PositionEncodingKind(encoding).value
        options = params.initialization_options
        ls.has_hints = not isinstance(options, dict) or options.get(INLAY_HINTS_OPTION) is not False
        capabilities = params.capabilities.text_document
        support = capabilities.code_action.resolve_support if capabilities and capabilities.code_action else None
        ls.resolves_edits = support is not None and "edit" in support.properties

    @server.feature(types.INITIALIZED)
    async def load_answers(ls: Server, params: types.InitializedParams) -> None:
        del params
        await ls.run_in_worker(import_module, "pidcfg.cli.lsp.answers")

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def did_open(ls: Server, params: types.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        ls.forget(document.uri)
        ls.files.put_buffer(document.uri, document.version, document.text)
        await ls.refresh(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def did_change(ls: Server, params: types.DidChangeTextDocumentParams) -> None:
        document = params.text_document
        ls.files.put_buffer(document.uri, document.version, params.content_changes[-1].text)
        await ls.refresh(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def did_save(ls: Server, params: types.DidSaveTextDocumentParams) -> None:
        del params
        await ls.refresh_all()

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def did_close(ls: Server, params: types.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        ls.files.drop_buffer(uri)
        ls.forget(uri)
        ls.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def did_change_on_disk(ls: Server, params: types.DidChangeWatchedFilesParams) -> None:
        del params
        await ls.refresh_all()


# --- What stands at a place -------------------------------------------------------------------------------------------


def _register_queries(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_HOVER)
    async def hover(ls: Server, params: types.HoverParams) -> types.Hover | None:
        from pidcfg.cli.lsp import answers

        return answers.hover_text(await ls.analysis(params.text_document.uri), params.position)

    @server.feature(types.TEXT_DOCUMENT_INLAY_HINT)
    async def hints(ls: Server, params: types.InlayHintParams) -> list[types.InlayHint]:
        from pidcfg.cli.lsp import answers

        return answers.inlay_hints(await ls.analysis(params.text_document.uri), params.range) if ls.has_hints else []

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def symbols(ls: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        from pidcfg.cli.lsp import answers

        return answers.outline_symbols(await ls.analysis(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    async def definition(ls: Server, params: types.DefinitionParams) -> types.Location | None:
        from pidcfg.cli.lsp import answers

        return answers.find_definition(await ls.analysis(params.text_document.uri), ls.files, params.position)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    async def references(ls: Server, params: types.ReferenceParams) -> list[types.Location]:
        from pidcfg.cli.lsp import answers

        analysis = await ls.analysis(params.text_document.uri)
        locations: list[types.Location] = await ls.run_in_worker(
            answers.all_references, analysis, ls.files, params.position
        )
        return locations

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[" ", "{", ","]))
    def complete(ls: Server, params: types.CompletionParams) -> list[types.CompletionItem]:
        from pidcfg.cli.lsp.completion import completions

        entry = ls.files.buffers.get(params.text_document.uri)
        return [] if entry is None else completions(entry.buffer, params.position, entry.last_doc, ls.files.reader)

    @server.feature(types.TEXT_DOCUMENT_CODE_LENS)
    async def lenses(ls: Server, params: types.CodeLensParams) -> list[types.CodeLens]:
        from pidcfg.cli.lsp import answers

        return answers.code_lenses(await ls.analysis(params.text_document.uri))


# --- What changes files -----------------------------------------------------------------------------------------------


def _register_edits(server: Server) -> None:
    kinds = types.CodeActionOptions(
        [types.CodeActionKind.QuickFix, types.CodeActionKind.SourceFixAll], resolve_provider=True
    )

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, kinds)
    async def actions(ls: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
        from pidcfg.cli.lsp import answers

        analysis = await ls.analysis(params.text_document.uri)
        code_actions: list[types.CodeAction] = await ls.run_in_worker(
            answers.code_actions, analysis, ls.files, params.range, lazy=ls.resolves_edits
        )
        only = params.context.only
        return [one for one in code_actions if only is None or any(_is_kind_of(one.kind, kind) for kind in only)]

    @server.feature(types.CODE_ACTION_RESOLVE)
    async def resolve_action(ls: Server, action: types.CodeAction) -> types.CodeAction:
        from pidcfg.cli.lsp import answers

        data: Any = action.data
        analysis = await ls.analysis(data["uri"])
        action_with_edit: types.CodeAction = await ls.run_in_worker(answers.with_edit, action, analysis, ls.files)
        return action_with_edit

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    async def prepare_rename(ls: Server, params: types.PrepareRenameParams) -> types.Range | None:
        from pidcfg.cli.lsp import answers

        return answers.renameable_range(await ls.analysis(params.text_document.uri), ls.files, params.position)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    async def rename(ls: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
        from pidcfg.cli.lsp import answers
        from pidcfg.output.places import RenamingError

        analysis = await ls.analysis(params.text_document.uri)
        try:
            edit: types.WorkspaceEdit | None = await ls.run_in_worker(
                answers.rename_loop, analysis, ls.files, params.position, params.new_name
            )
        except RenamingError as error:
            raise JsonRpcInvalidRequest(str(error)) from None
        return edit


# --- What stands above a scenario and a loop --------------------------------------------------------------------------


def _register_commands(server: Server) -> None:
    @server.command(RUN_COMMAND)
    async def run(ls: Server, uri: str) -> str:
        text, passed = await asyncio.to_thread(_run_scenario, path_of(uri), ls.files)
        kind = types.MessageType.Info if passed else types.MessageType.Warning
        ls.window_show_message(types.ShowMessageParams(kind, text))
        return text

    @server.command(WORDS_COMMAND)
    async def words(ls: Server, uri: str, loop: str) -> str:
        from pidcfg.cli.lsp import answers

        text = answers.words_text(await ls.analysis(uri), loop)
        ls.window_show_message(types.ShowMessageParams(types.MessageType.Info, text))
        return text


def _is_kind_of(kind: str | None, other: str) -> bool:
    """Whether a kind of action is another one or one below it."""
    return kind == other or (kind or "").startswith(f"{other}.")


def _run_scenario(path: str, files: Files) -> tuple[str, bool]:
    """A scenario's run as ``simulate`` tells it, and whether it passed."""
    from pidcfg.api import simulate
    from pidcfg.cli.formats.runs import render_runs
    from pidcfg.text.diagnostics import Severity

    result = simulate(Path(path), files=files.reader)
    return render_runs("text", [result.outcome], Severity.ERROR), result.passed
