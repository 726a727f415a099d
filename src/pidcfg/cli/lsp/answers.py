"""What the server answers: findings, hover texts, words beside values, outlines, corrections, places of names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from lsprotocol import types

from pidcfg.cli.lsp import RUN_COMMAND, WORDS_COMMAND
from pidcfg.cli.lsp.completion import describe_key, schema_of
from pidcfg.cli.lsp.files import Analysis, Buffer, Files, difference_range, uri_of
from pidcfg.output.findings import check_any, correct_file
from pidcfg.output.places import Holder, Reference, RenamingError, configuration_of, loops_of, references, rename_edits
from pidcfg.text.diagnostics import START, Diagnostic, Severity, Span
from pidcfg.text.document import Document, Node, span_of
from pidcfg.text.paths import Data, Path, value_at
from pidcfg.text.reader import Overlay, data_of, read_named_file
from pidcfg.text.source import comments_in, read_document
from pidcfg.validate import rule_page, text_by_code
from pidcfg.validate.baseline import DIRECTIVE, ignore_edit
from pidcfg.validate.catalog import url_of
from pidcfg.validate.engine import is_scenario
from pidcfg.validate.fixes import SUGGESTION, apply_edits, suggest_edits

DIAGNOSTIC_SOURCE = "pidcfg"
LSP_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.INFO: types.DiagnosticSeverity.Information,
}

# --- Findings ---------------------------------------------------------------------------------------------------------


def diagnostics(analysis: Analysis) -> list[types.Diagnostic]:
    """The findings of a file as the editor shows them."""
    return [_diagnostic(d, analysis) for d in analysis.findings]


def _diagnostic(d: Diagnostic, analysis: Analysis) -> types.Diagnostic:
    file_prefix = "" if d.file == analysis.file else f"{d.file}:{d.span.line}: "
    rows = (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
    address = url_of(d.code, absolute=True)
    return types.Diagnostic(
        range=place_of(d, analysis),
        message="\n".join([f"{file_prefix}{d.message}", *(f"{label}: {text}" for label, text in rows if text)]),
        severity=LSP_SEVERITIES[d.severity],
        code=d.code,
        code_description=types.CodeDescription(address) if address else None,
        source=DIAGNOSTIC_SOURCE,
        related_information=_related_places(d, analysis) or None,
    )


def place_of(d: Diagnostic, analysis: Analysis) -> types.Range:
    """Where a finding is shown: what it has of another file at the beginning of this one."""
    return analysis.buffer.range(START if d.file != analysis.file else d.span)


def _related_places(d: Diagnostic, analysis: Analysis) -> list[types.DiagnosticRelatedInformation]:
    """The names of the other loops of the same fault."""
    others = (place for place in (loops_of(analysis.document) if d.with_loops else ()) if place.name in d.with_loops)
    return [
        types.DiagnosticRelatedInformation(
            types.Location(analysis.uri, analysis.buffer.range(place.span)), f"the same fault in {place.name}"
        )
        for place in others
    ]


# --- What stands at a place: what a key is, what may stand there, and the word that it becomes; what a comment ignores


def hover_text(analysis: Analysis, position: types.Position) -> types.Hover | None:
    """What is known of the key or value at a position, or of the codes of an ignore comment."""
    line, column = analysis.buffer.line_and_column(position)
    if (comment_hover := _comment_hover(analysis, line, column)) is not None:
        return comment_hover
    doc = analysis.document if analysis.document.data is not None else analysis.last_doc
    entry = None if doc is None else doc.at(line, column)
    if doc is None or entry is None:
        return None
    key = entry.path if isinstance(entry.path[-1], str) else entry.path[:-1]
    texts = [describe_key(schema_of(doc), key, data=doc.data)]
    texts += [_word_text(held) for held in _words_below(analysis, entry.path)]
    text = "\n\n".join(filter(None, texts))
    return types.Hover(_markdown(text), analysis.buffer.range(entry.span)) if text else None


def _words_below(analysis: Analysis, path: Path) -> list[Holder]:
    """What holds a value; of a key with several parts all of them; of a template's in each loop that has it."""
    if path[0] == "templates":
        paths = [("loops", i, *path[2:]) for i in range(len((analysis.document.data or {}).get("loops") or ()))]
        return [held for loop_path in paths for held in _words_below(analysis, loop_path)]
    return [held for key, held in analysis.words.items() if key[: len(path)] == path and len(key) - len(path) < 2]


def _word_text(held: Holder) -> str:
    """A word with its content, hexadecimal and decimal, and its place in the manual."""
    loop = f" of {held.loop}" if held.loop else ""
    number = f" (hexadecimal {held.raw:04X}, decimal {held.raw})" if held.raw is not None else ""
    title = f": {held.title}" if held.title else ""
    basis = f"  \n{held.basis}" if held.basis else ""
    return f"`{held.address}` = `{held.shown}`{number}{title}{loop}{basis}"


def _comment_hover(analysis: Analysis, line: int, column: int) -> types.Hover | None:
    """The rules that a comment at this place ignores."""
    doc = analysis.document
    if doc.data is None or "pidcfg:" not in doc.text or line > len(doc.lines) or "#" not in doc.lines[line - 1]:
        return None
    comment = next((one for one in comments_in(doc.text) if one.line == line and one.column <= column), None)
    match = DIRECTIVE.match(comment.text) if comment is not None else None
    if comment is None or match is None or not match["codes"]:
        return None
    codes = [code.strip().upper() for code in match["codes"].split(",")]
    text = "\n---\n".join(rule_page(rule) for code in codes if (rule := text_by_code(code)) is not None)
    span = Span(line, comment.column, line, comment.column + match.end())
    return types.Hover(_markdown(text), analysis.buffer.range(span)) if text else None


def _markdown(text: str) -> types.MarkupContent:
    return types.MarkupContent(types.MarkupKind.Markdown, text)


# --- Words beside the values ------------------------------------------------------------------------------------------


def inlay_hints(analysis: Analysis, shown_range: types.Range) -> list[types.InlayHint]:
    """``⟶ V2010 0250`` behind each value that a register holds; nothing where the parameter is the key itself."""
    doc = analysis.document
    words_by_span: dict[Span, list[Holder]] = {}
    for path, held in analysis.words.items():
        node = _scalar_node(doc, path)
        if node is not None and (held.raw is not None or not held.address.endswith(str(path[-1]))):
            words_by_span.setdefault(node.span, []).append(held)
    hints = []
    for span, words in words_by_span.items():
        position = analysis.buffer.range(span).end
        if shown_range.start.line <= position.line <= shown_range.end.line:
            more = f" and {len(words) - 1} more" if len(words) > 1 else ""
            label = f"⟶ {words[0].address} {words[0].shown}{more}"
            tooltip = words[0].title or None
            hints.append(types.InlayHint(position, label, tooltip=tooltip, padding_left=True))
    return hints


def _scalar_node(doc: Document, path: Path) -> Node | None:
    """The scalar that stands at a path; the value itself must be in the file."""
    node = doc.root
    for step in path:
        entry = node.child(step)
        if entry is None:
            return None
        node = entry[1]
    return node if node.children is None and node.event is not None else None


# --- The outline, and what can be done with a loop or a scenario ------------------------------------------------------

OUTLINE_DEPTH = 4
"""Levels of the outline."""


def outline_symbols(analysis: Analysis) -> list[types.DocumentSymbol]:
    """Sections, loops, plants, and what they hold."""
    doc = analysis.document if analysis.document.data is not None else None
    return [] if doc is None else list(_symbols_below(doc.root, doc.data, analysis.buffer, OUTLINE_DEPTH))


def _symbols_below(node: Node, data: object, buffer: Buffer, depth: int) -> Iterator[types.DocumentSymbol]:
    """The keys and items below a node; the items of a list go by their names, and plain ones are left out."""
    for step, start, child in _children_of(node) if depth else ():
        value = value_at(data, (step,))
        if isinstance(step, int) and child.children is None:
            continue
        mapping = value if isinstance(step, int) and isinstance(value, dict) else {}
        name = str(mapping.get("name") or mapping.get("loop") or step + 1) if isinstance(step, int) else step
        parts = list(_symbols_below(child, value, buffer, depth - 1)) if child.children is not None else []
        detail = str(value)[:60] if isinstance(value, str) else ""
        kind = types.SymbolKind.Object if isinstance(step, int) else types.SymbolKind.Property
        whole_range = buffer.range(Span(start.line, start.column, *_end_of(child, (start.end_line, start.end_column))))
        yield types.DocumentSymbol(name or "-", kind, whole_range, buffer.range(start), detail, children=parts or None)


def _children_of(node: Node) -> Iterator[tuple[str | int, Span, Node]]:
    """Each key or item below a node, with the place of its key, or of itself."""
    if isinstance(node.children, dict):
        yield from ((key, span_of(event), child) for key, (event, child) in node.children.items())
    else:
        yield from ((i, child.span, child) for i, child in enumerate(node.children or ()))


def _end_of(node: Node, min_end: tuple[int, int]) -> tuple[int, int]:
    """Where a value ends, which for a mapping is where its last part does."""
    span = node.span
    return max([min_end, (span.end_line, span.end_column), *(_end_of(child, min_end) for child in node.items)])


def code_lenses(analysis: Analysis) -> list[types.CodeLens]:
    """Run, over a scenario; words, over each loop of a configuration that can be encoded."""
    doc = analysis.document
    if is_scenario(doc):
        command = types.Command("▶ run", RUN_COMMAND, arguments=[analysis.uri])
        return [types.CodeLens(analysis.buffer.range(doc.locate(("scenario",), key=True)), command)]
    return [
        types.CodeLens(
            analysis.buffer.range(place.span),
            types.Command("words", WORDS_COMMAND, arguments=[analysis.uri, place.name]),
        )
        for place in (loops_of(doc) if analysis.words else ())
    ]


def words_text(analysis: Analysis, loop: str) -> str:
    """The words of a loop, a line each."""
    rows = [held for held in analysis.words.values() if held.loop == loop]
    width = max((len(held.address) for held in rows), default=0)
    return "".join(f"{held.address:<{width}}  {held.shown:>8}  {held.title}\n" for held in rows)


# --- Corrections: the edits of ``--fix`` with their proof, and comments that ignore -----------------------------------


def code_actions(analysis: Analysis, files: Files, shown_range: types.Range, *, lazy: bool) -> list[types.CodeAction]:
    """What can be done about the findings at a place; ``lazy``: the editor asks again for the edit of one."""
    doc = analysis.document
    findings = [d for d in analysis.findings if d.file == doc.file and _touches(place_of(d, analysis), shown_range)]
    actions = []
    for d in findings:
        if d.edits:
            actions.append(_code_action(_correction_title(d), {"code": d.code, "at": _position_of(d)}, d, analysis))
            if sum(bool(other.edits) for other in analysis.findings if other.code == d.code) > 1:
                actions.append(_code_action(f"Correct every {d.code} of this file", {"code": d.code}, d, analysis))
        else:
            words = [edit.text for edit in suggest_edits(d, doc)]
            data = {"code": d.code, "at": _position_of(d)}
            actions += [_code_action(f"Write {word}", {**data, "write": word}, d, analysis) for word in words]
    if any(d.edits for d in analysis.findings):
        kind = types.CodeActionKind.SourceFixAll
        actions.append(_code_action("Correct everything that has one reading", {}, None, analysis, kind))
    for d in findings:
        if ignore_edit(doc, d, "") is not None:
            title = f"Ignore {d.code} here, with the reason that you write behind it"
            actions.append(_code_action(title, {"ignore": d.code, "at": _position_of(d)}, d, analysis))
    with_edits = actions if lazy else [with_edit(action, analysis, files) for action in actions]
    return [action for action in with_edits if lazy or action.edit is not None]


def _correction_title(d: Diagnostic) -> str:
    """What a correction does, as an order: ``Write setpoint``."""
    if d.help is None:
        return f"Correct: {d.message}"
    match = SUGGESTION.fullmatch(d.help)
    return f"Write {match[1]}" if match is not None and match[1] else d.help[0].upper() + d.help[1:]


def _code_action(
    title: str,
    data: Data,
    d: Diagnostic | None,
    analysis: Analysis,
    kind: str = types.CodeActionKind.QuickFix,
) -> types.CodeAction:
    diagnostics = None if d is None else [_diagnostic(d, analysis)]
    return types.CodeAction(title, kind, diagnostics, data={"uri": analysis.uri, **data})


def _position_of(d: Diagnostic) -> list[int]:
    return [d.span.line, d.span.column]


def _touches(first: types.Range, other: types.Range) -> bool:
    """Whether two places have a line in common."""
    return first.start.line <= other.end.line and other.start.line <= first.end.line


def with_edit(action: types.CodeAction, analysis: Analysis, files: Files) -> types.CodeAction:
    """An action with its edit; without one where what it was for has gone, or cannot be proven."""
    data: Data = action.data if isinstance(action.data, dict) else {}
    doc, before = analysis.document, analysis.buffer.text
    request = {"code": data.get("ignore") or data.get("code"), "at": data.get("at")}
    findings = [
        d for d in analysis.findings if request["code"] in {None, d.code} and request["at"] in (None, _position_of(d))
    ]
    if "ignore" in data:
        edit = ignore_edit(doc, findings[0], "") if findings else None
        after = before if edit is None else before.removesuffix(doc.text) + apply_edits(doc.text, [edit])
    elif "write" in data:
        after = _with_word(doc, before, findings, files, data["write"])
    else:
        wanted_keys = {(d.code, *_position_of(d)) if request["at"] else d.code for d in findings}
        fixed = correct_file(
            data_of(before),
            doc,
            files.reader,
            lambda d: not wanted_keys.isdisjoint({d.code, (d.code, *_position_of(d))}),
        )
        after = fixed.data.decode("utf-8", "replace")
    if after != before:
        action.edit = edit_of(analysis.uri, analysis.version, analysis.buffer, after)
    return action


def _with_word(doc: Document, before: str, findings: list[Diagnostic], files: Files, word: object) -> str:
    """A text with a word that its finding asks for, if the finding then has gone."""
    edit = next((suggestion for d in findings for suggestion in suggest_edits(d, doc) if suggestion.text == word), None)
    if edit is None:
        return before
    after = before.removesuffix(doc.text) + apply_edits(doc.text, [edit])
    remaining = check_any(read_document(data_of(after), doc.file), files.reader)
    return (
        before
        if any((d.code, _position_of(d)) == (findings[0].code, _position_of(findings[0])) for d in remaining)
        else after
    )


def edit_of(uri: str, version: int | None, buffer: Buffer, after: str) -> types.WorkspaceEdit:
    """The edit that makes a text another one, in the one stretch where they differ."""
    begin, end, text = difference_range(buffer.text, after)
    change = types.TextEdit(types.Range(buffer.position(begin), buffer.position(end)), text)
    document = types.OptionalVersionedTextDocumentIdentifier(uri, version)
    return types.WorkspaceEdit(document_changes=[types.TextDocumentEdit(document, [change])])


# --- Where a loop is named: its definition, all places, and another name for it ---------------------------------------


def _find_named_loop(analysis: Analysis, files: Files, position: types.Position) -> tuple[Reference, Document] | None:
    """The loop that is named at a position, and the configuration that it is of."""
    doc = analysis.document if analysis.document.data is not None else analysis.last_doc
    config = None if doc is None else configuration_of(doc, files.reader)
    if doc is None or config is None:
        return None
    line, column = analysis.buffer.line_and_column(position)
    names = {place.name for place in loops_of(config)}
    references_here = (reference for reference in references(doc, names) if reference.span.line == line)
    reference_here = next(
        (reference for reference in references_here if reference.span.column <= column <= reference.span.end_column),
        None,
    )
    return None if reference_here is None else (reference_here, config)


def find_definition(analysis: Analysis, files: Files, position: types.Position) -> types.Location | None:
    """Where the loop that is named here has its name; of the name of a file, that file."""
    named_loop = _find_named_loop(analysis, files, position)
    if named_loop is not None:
        reference, config = named_loop
        place = next(place for place in loops_of(config) if place.name == reference.loop)
        return types.Location(uri_of(config.file), files.buffer_of(config.file, config.text).range(place.span))
    doc = analysis.document
    entry = doc.at(*analysis.buffer.line_and_column(position)) if doc.data is not None else None
    if entry is None or entry.path[-1] not in {"config", "map", "reference"}:
        return None
    name = doc.data.get(entry.path[-1]) if isinstance(doc.data, dict) and len(entry.path) == 1 else None
    name = name if isinstance(name, str) else (doc.data or {}).get("plc", {}).get(entry.path[-1])
    return None if not isinstance(name, str) else _file_location(files, doc, name)


def _file_location(files: Files, doc: Document, name: str) -> types.Location | None:
    place = files.reader.resolve(doc.file, name)
    try:
        read_named_file(files.reader, place, 1)
    except (OSError, ValueError):
        return None
    start = types.Position(0, 0)
    return types.Location(uri_of(place), types.Range(start, start))


def all_references(analysis: Analysis, files: Files, position: types.Position) -> list[types.Location]:
    """Every place of the configuration and of its scenarios that names this loop."""
    named_loop = _find_named_loop(analysis, files, position)
    if named_loop is None:
        return []
    reference, config = named_loop
    return [
        types.Location(uri_of(doc.file), files.buffer_of(doc.file, doc.text).range(place.span))
        for doc in _related_documents(config, files)
        for place in references(doc, {reference.loop})
    ]


def _related_documents(config: Document, files: Files) -> list[Document]:
    """A configuration and the scenarios that run it, each once."""
    return list({doc.file: doc for doc in (config, *files.scenarios(config.file))}.values())


def renameable_range(analysis: Analysis, files: Files, position: types.Position) -> types.Range | None:
    """The name of a loop that stands here."""
    named_loop = _find_named_loop(analysis, files, position)
    return None if named_loop is None else analysis.buffer.range(named_loop[0].span)


def rename_loop(analysis: Analysis, files: Files, position: types.Position, name: str) -> types.WorkspaceEdit | None:
    """The edits that give a loop another name in every file; raises `RenamingError` where one would be wrong."""
    named_loop = _find_named_loop(analysis, files, position)
    if named_loop is None:
        return None
    reference, config = named_loop
    docs = _related_documents(config, files)
    unreadable = next((doc.file for doc in docs if doc.data is None), None)
    if unreadable is not None:
        raise RenamingError(f"{unreadable} cannot be read; correct it first")

    def check_documents(texts: Mapping[str, Document]) -> list[Diagnostic]:
        reader = Overlay({**files.reader.texts, **{file: doc.text for file, doc in texts.items()}})
        return [d for doc in texts.values() for d in check_any(doc, reader)]

    changes = []
    for file, edits in rename_edits(docs, reference.loop, name, check_documents).items():
        text = next(doc.text for doc in docs if doc.file == file)
        buffer, entry = files.buffer_of(file, text), files.buffers.get(uri_of(file))
        version = None if entry is None else entry.version
        document = types.OptionalVersionedTextDocumentIdentifier(uri_of(file), version)
        rows = [types.TextEdit(buffer.range(edit.span), edit.text) for edit in edits]
        changes.append(types.TextDocumentEdit(document, rows))
    return types.WorkspaceEdit(document_changes=changes)
