"""JSON Schemas by their names: of a vendor's files, of scenarios, and of what the commands print as JSON."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any, get_args

from pidcfg.text.diagnostics import Severity
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pydantic import BaseModel


SCENARIO = "scenario"


def schema(name: str) -> Schema:
    """The JSON Schema of a vendor's files (``dl06``), with templates, of ``scenario``, or of an output.

    Raises `KeyError` for another name.
    """
    plain = plain_schema(name)
    return with_templates(plain) if name in VENDORS else plain


def plain_schema(name: str) -> Schema:
    """The same without templates."""
    if name in OUTPUTS:
        return output_schema(name)
    from pidcfg.schemas.document import json_schema

    return json_schema(_model(name), name, _title(name))


def _model(name: str) -> type[BaseModel]:
    if name == SCENARIO:
        from pidcfg.schemas.scenario import Scenario

        return Scenario
    return VENDORS[name].model


def _title(name: str) -> str:
    return "pidcfg scenario" if name == SCENARIO else f"pidcfg configuration for {VENDORS[name].title}"


# --- Templates: parts of loops, in which nothing is required, and loops that use one ----------------------------------

PART = "Part"
"""Behind the name of a definition: the same with nothing required."""
REFERENCE = "#/$defs/"
TEMPLATES_TEXT = (
    "What equal loops have in common, by a name of its own: a loop with `use: NAME` has all of it, and what it writes "
    "itself wins. A template may use another one."
)
USE_TEXT = "The template whose values the loop has; what the loop writes itself wins, lists as a whole."


def with_templates(schema: Schema) -> Schema:
    """The schema of a configuration file whose loops may use templates."""
    loops = schema["properties"]["loops"]
    whole = loops["items"]
    part = _part(deepcopy(whole))
    used = {ref.removeprefix(REFERENCE) for ref in _references(whole)}
    definitions = {f"{name}{PART}": _part(deepcopy(definition)) for name, definition in schema["$defs"].items()}
    for name in used:
        definitions[f"{name}{PART}"]["properties"]["use"] = {"type": "string", "description": USE_TEXT}
    schema["$defs"] |= definitions
    loops["items"] = {
        "if": {"required": ["use"]},
        "then": {"allOf": [{"required": ["name"]}, part]},
        "else": whole,
    }
    templates = {"type": "object", "description": TEMPLATES_TEXT, "additionalProperties": part}
    schema["properties"] = {"templates": templates, **schema["properties"]}
    return schema


def _part(value: Any) -> Any:
    """A schema in which nothing is required, all the way down; it has no title, or an editor would show both."""
    if isinstance(value, list):
        return [_part(item) for item in value]
    if not isinstance(value, dict):
        return value
    if "discriminator" in value and "oneOf" in value:
        return {"anyOf": [_part(kind) for kind in value["oneOf"]]}
    return {
        key: f"{item}{PART}" if key == "$ref" else _part(item)
        for key, item in value.items()
        if not (key == "required" and isinstance(item, list)) and not (key == "title" and isinstance(item, str))
    }


def _references(value: Schema) -> list[str]:
    """The definitions of an item: one, or the choices of several."""
    if "$ref" in value:
        return [value["$ref"]]
    return [kind["$ref"] for kind in value.get("oneOf", ()) if "$ref" in kind]


# --- What the commands print as JSON: every object lists all of its keys ----------------------------------------------

DIALECT = "https://json-schema.org/draft/2020-12/schema"
OUTPUTS = {
    "output-validate": ("findings_schema", "validate --format json"),
    "output-statistics": ("counts_schema", "validate --statistics --format json"),
    "output-simulate": ("runs_schema", "simulate --format json"),
    "output-certify": ("batches_schema", "certify --format json"),
    "output-convert": ("conversion_schema", "convert --report json"),
    "output-diff": ("differences_schema", "diff --format json"),
    "output-tune": ("gains_schema", "tune --format json"),
    "output-rule": ("rules_schema", "rule --format json"),
    "output-encode": ("words_schema", "encode --format json"),
}
"""Name of each schema, the function here that gives it, and the command that it is about."""


def output_schema(name: str) -> Schema:
    """One of the schemas."""
    function, command = OUTPUTS[name]
    title = f"What pidcfg {command} prints, version 1"
    layout: Schema = globals()[function]()
    return {"$schema": DIALECT, "title": title, **layout}


# --- What the schemas are put together from ---------------------------------------------------------------------------

Schema = dict[str, Any]
VERSION: Schema = {"const": 1, "description": "The version of this layout."}


def record(description: str, optional: tuple[str, ...] = (), /, **keys: Schema) -> Schema:
    """An object that has these keys and no others; a trailing underscore keeps a key from being a word of Python."""
    names = {key.rstrip("_"): schema for key, schema in keys.items()}
    required = [name for name in names if name not in optional]
    return {
        "description": description,
        "type": "object",
        "properties": names,
        "required": required,
        "additionalProperties": False,
    }


def by_name(description: str, value: Schema) -> Schema:
    """An object whose keys are names of the user's files."""
    return {"description": description, "type": "object", "additionalProperties": value}


def listing(description: str, item: Schema) -> Schema:
    """A list."""
    return {"description": description, "type": "array", "items": item}


def text(description: str, *choices: str) -> Schema:
    """Text, or one of some words."""
    return {"description": description, **({"enum": list(choices)} if choices else {"type": "string"})}


def number(description: str) -> Schema:
    """A number."""
    return {"description": description, "type": "number"}


def count(description: str, least: int = 0) -> Schema:
    """A whole number."""
    return {"description": description, "type": "integer", "minimum": least}


def switch(description: str) -> Schema:
    """True or false."""
    return {"description": description, "type": "boolean"}


def or_null(schema: Schema) -> Schema:
    """The same, or null where there is none."""
    if "enum" in schema:
        return {**schema, "enum": [*schema["enum"], None]}
    return {**schema, "type": [schema["type"], "null"]}


def anything(description: str) -> Schema:
    """A value as the user's file or the PLC has it."""
    return {"description": description, "type": ["null", "boolean", "number", "string", "array"]}


def one_or_several(name: str, plural: str, one: Schema, **parts: Schema) -> Schema:
    """What stands alone for one scenario, and for several in a list; ``parts``: its parts."""
    several = record(
        "Several scenarios.",
        version=VERSION,
        **{plural: listing("One a scenario.", {"$ref": f"#/$defs/{name}"})},
        passed=switch(f"Whether every {name} passed."),
    )
    alone = {**one, "properties": {"version": VERSION, **one["properties"]}, "required": ["version", *one["required"]]}
    return {"oneOf": [alone, several], "$defs": {name: one, **parts}}


# --- Findings, as ``validate`` prints them, and the others when they cannot use a file --------------------------------


def findings_schema() -> Schema:
    """All findings, and how many there are."""
    return record(
        "What was found in all files.",
        version=VERSION,
        findings=listing("By file and place.", finding()),
        summary=record(
            "How many files were looked at, and how many findings of each kind are listed.",
            files=count("Files that were looked at."),
            errors=count("Findings that fail the run."),
            warnings=count("Findings that fail it under --strict."),
            infos=count("What is worth knowing."),
        ),
    )


def finding() -> Schema:
    """One finding."""
    return record(
        "One finding.",
        code={
            "description": "The rule; pidcfg rule CODE explains it.",
            "type": "string",
            "pattern": "^[A-Z]{2,3}[0-9]{3}$",
        },
        severity=text("How bad it is.", *(severity.label for severity in reversed(Severity))),
        message=text("What is wrong, with the value."),
        file=text("The file as it was named, with forward slashes; <stdin> for standard input."),
        line=count("Where the value is written; the first line is 1.", 1),
        column=count("The first column is 1; columns are Unicode code points.", 1),
        end_line=count("The line in which the value ends.", 1),
        end_column=count("The column behind its last character.", 1),
        path=text("The key, such as loops[1].tuning.reset; empty for the file as a whole."),
        loop=text("The loop that it concerns; empty where it concerns none."),
        with_=listing("The other loops of the same fault; each has a finding that names this one.", text("A loop.")),
        plc_effect=or_null(text("What the PLC would do.")),
        reference=or_null(text("The place in the manual, or the decision, that the rule rests on.")),
        help=or_null(text("The cure.")),
        url=text("The rule's page: an address, or seen from the root of the documentation site where it has none."),
    )


# --- Findings counted by their rules ----------------------------------------------------------------------------------


def counts_schema() -> Schema:
    """How often each rule has something to say."""
    fields = finding()["properties"]
    row = record(
        "A rule, with one severity.",
        code=fields["code"],
        severity=fields["severity"],
        title=text("What is wrong."),
        count=count("Findings.", 1),
        fixable=count("Those that --fix corrects."),
    )
    return record(
        "Findings by rule.",
        version=VERSION,
        statistics=listing("The most frequent first.", row),
        summary=findings_schema()["properties"]["summary"],
    )


# --- The documentation of rules ---------------------------------------------------------------------------------------


def rules_schema() -> Schema:
    """One rule, or a list of them."""
    fields = finding()["properties"]
    one = record(
        "A rule.",
        code=fields["code"],
        name=text("A name in words."),
        severity=fields["severity"],
        title=text("What is wrong."),
        message=text("The message, with the names of its values in braces."),
        why=text("Why that matters."),
        fix=text("The cure."),
        reference=text("The manual's place or the decision."),
        since=text("The version that has it first."),
    )
    alone = {**one, "properties": {"version": VERSION, **one["properties"]}, "required": ["version", *one["required"]]}
    several = record("Several rules.", version=VERSION, rules=listing("By code.", one))
    return {"oneOf": [alone, several]}


# --- The PLC's memory -------------------------------------------------------------------------------------------------

CONTENT: Schema = {"description": "As the vendor shows it.", "type": ["boolean", "number"]}
OPEN: Schema = {"description": "In the terms of the vendor.", "type": "object", "additionalProperties": True}


def words_schema() -> Schema:
    """Every word; or findings, when the file cannot be encoded."""
    image = record(
        "The PLC's memory for a configuration.",
        version=VERSION,
        vendor=text("The PLC family.", *VENDORS),
        words=listing("In the order of addresses.", {"oneOf": [register(), parameter(), wired()]}),
        settings=listing("What no register holds, an object a loop.", OPEN),
        plc=OPEN,
        checklist=listing("What a person should check after the download.", text("An item.")),
    )
    return {"oneOf": [image, findings_schema()]}


def register() -> Schema:
    """A register with an address."""
    return record(
        "A register.",
        address=text("As the vendor writes it."),
        value=CONTENT,
        hex=text("The raw content in hexadecimal digits."),
        loop=or_null(text("The loop that it belongs to.")),
        field=text("What it holds."),
    )


def parameter() -> Schema:
    """A parameter with a name."""
    return record("A parameter.", ("device",), **_named(), value={**CONTENT, "type": ["boolean", "number", "string"]})


def wired() -> Schema:
    """A parameter that follows an expression."""
    return record("A parameter that follows others.", ("device",), **_named(), expression=text("What it follows."))


def _named() -> dict[str, Schema]:
    from pidcfg.encoders.parameters import TYPES

    return {
        "address": text("Its name."),
        "type": text("Its type.", *TYPES),
        "device": text("Its place in the PLC, where it has one."),
        "loop": or_null(text("The loop or block that it belongs to.")),
        "field": text("What it holds."),
    }


# --- The verdict of the battery ---------------------------------------------------------------------------------------


def verified() -> Schema:
    """One loop's verdict."""
    return record(
        "A loop.",
        loop=text("Its name."),
        passed=switch("Whether the target does what the source's numbers do under its rules."),
        pv_percent=number("The PVs at most apart in the step and the disturbance, in % of the range."),
        output_percent=number("The outputs at most."),
        iae_ratio=or_null(number("Integral of the absolute error, after to before.")),
        stages=listing("Those that were run.", text("Its name.")),
        not_tried=listing(
            "Those in which the source does not go to a mode that is asked of it.",
            record("A stage.", stage=text("Its name."), mode=text("The mode.")),
        ),
        differences=listing(
            "What nothing explains.", signal_difference(key=or_null(text("The key that explains it.")))
        ),
        named=listing(
            "Where source and target differ, as a line of the report says.",
            signal_difference(
                line=or_null(text("The field of the line; null where several lines do it together.")),
                note=text("What it says; may be empty."),
            ),
        ),
        run_with=listing(
            "What the source's numbers were run with: values and rules of the target.",
            record("A line of the report.", line=text("Its field."), to=anything("What the target has.")),
        ),
        not_shown=listing("Numbers of which no stage can tell another value.", text("The field of the neutral form.")),
    )


def signal_difference(**more: Schema) -> Schema:
    """A signal that differs in a stage."""
    return record(
        "A signal in a stage.",
        stage=text("Its name."),
        signal=text("pv, output, setpoint, mode, run, or the name of an alarm."),
        at=number("The first time, in s from the beginning of the stage."),
        from_=anything("What the first side shows then; outputs as shares of the range."),
        to=anything("What the second side shows."),
        percent=or_null(number("How far a number lies apart at most, in % of its range.")),
        **more,
    )


# --- The report of a conversion ---------------------------------------------------------------------------------------


def conversion_schema() -> Schema:
    """What became of every field; or findings, when the file cannot be converted."""
    report = record(
        "What became of every field.",
        ("verify",),
        version=VERSION,
        from_=text("The PLC family of the file.", *VENDORS),
        to=text("The PLC family that it was converted to.", *VENDORS),
        loops=listing(
            "One a loop.",
            record(
                "A loop.",
                loop=text("Its name."),
                status=text("Whether it went over.", "converted", "dropped"),
                reason=or_null(text("Why it was dropped.")),
                changes=listing("Of all fields.", change()),
            ),
        ),
        findings=listing("What the target's own rules find at fault in the result.", finding()),
        verify=listing("With --verify: the verdict of the battery.", verified()),
    )
    return {"oneOf": [report, findings_schema()]}


def change() -> Schema:
    """What became of a field."""
    from pidcfg.conversion import KINDS_BY_HARM

    return record(
        "What became of a field.",
        field=text("Its key; in the source where that has one, else in the result."),
        target_field=or_null(text("Its key in the result.")),
        kind=text("From harmless to harmful.", *KINDS_BY_HARM),
        from_=anything("The value before."),
        to=anything("The value after."),
        error_percent=number("How far the value that acts is off."),
        counts_apart=number("Of an exact number: how far the words of both sides are apart, in the coarser counts."),
        loss=switch("Whether it needs leave: dropped, clamped, or rounded beyond --max-loss."),
        neutral=or_null(
            record(
                "A number that is not exact, both sides in one unit.",
                field=text("Its neutral field."),
                from_=number("What was wanted."),
                to=number("What the target holds."),
                unit=text("Of both; may be empty."),
            )
        ),
        note=text("What it means; may be empty."),
    )


# --- Differences of two configurations --------------------------------------------------------------------------------


def differences_schema() -> Schema:
    """Loops and their differences; or findings, when a file cannot be compared."""
    from pidcfg.conversion.differences import RISKS, Status

    counts = {risk: count("Differences of this risk.") for risk in RISKS}
    counts |= {status: count("Loops of this status.") for status in get_args(Status)}
    report = record(
        "How two configurations differ.",
        ("verify",),
        version=VERSION,
        from_=text("The first file."),
        to=text("The second file."),
        loops=listing("One a loop; one without a name is the rest of the file.", compared_loop()),
        summary=record("How many there are.", **counts),
        notes=listing("What a listing did not say, or could not be read of it.", text("A note.")),
        verify=listing("With --verify: the verdict of the battery.", verified()),
    )
    return {"oneOf": [report, findings_schema()]}


def compared_loop() -> Schema:
    """A loop on both sides, or on one."""
    from pidcfg.conversion.differences import Status

    place = record("Where its registers begin.", from_=text("Before."), to=text("After."))
    return record(
        "A loop.",
        loop=text("Its name; empty: what belongs to no loop."),
        status=text("What became of it; one that is renamed or moved may have differences.", *get_args(Status)),
        was=or_null(text("Its name before, where it is another one.")),
        moved=or_null(place),
        differences=listing("The gravest first.", key_difference()),
        operated=listing("What the operator sets; no difference.", key_difference()),
        left_out=listing("Keys of words that differ and that the PLC or the process writes.", text("A key.")),
        missing=listing("Keys that a listing does not hold.", text("A key.")),
        states=listing("What a listing says of a loop that does not run as it is set up.", loop_state()),
    )


def loop_state() -> Schema:
    """An error, a stop or an auto-tune that a word tells of."""
    from pidcfg.conversion.differences import StateKind

    return record(
        "A state of a loop.",
        kind=text("An error, an algorithm that does not run, or an auto-tune.", *get_args(StateKind)),
        text=text("What it is."),
        key=text("The register's name."),
        address=text("The register, or its bit."),
        word=text("Its content as the PLC shows it."),
        side=or_null(text("The listing, where both sides are listings.")),
    )


def key_difference() -> Schema:
    """A key that differs."""
    from pidcfg.conversion.differences import RISKS

    return record(
        "A key that differs.",
        field=text("The field of the neutral form, else the key."),
        key=or_null(text("The key of the file; null between two vendors.")),
        risk=text("What can go wrong.", *RISKS),
        from_=anything("The value before; null: not given."),
        to=anything("The value after; null: not given."),
        unit=text("The unit of both values; may be empty."),
        address=or_null(text("The register; null: none holds it.")),
        word_from=or_null(text("The content of the register before, as the PLC shows it.")),
        word_to=or_null(text("The content after.")),
        note=text("What it means; may be empty."),
    )


# --- Runs of scenarios ------------------------------------------------------------------------------------------------


def runs_schema() -> Schema:
    """One run, or a list of them when several scenarios were named."""
    return one_or_several("run", "runs", run(), loop=loop_of_run(), finding=finding())


def run() -> Schema:
    """One run; what has not run has nulls and empty lists."""
    from pidcfg.sim.judgement.report import ScanTime

    extreme = {key: number(f"Signal's {key}.") for key in ("min", "max", "final")}
    return record(
        "One scenario.",
        ("scan_time",),
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        engine=or_null(text("What calculated it.", "python", "numba")),
        plc_flags=by_name("Error registers of the PLC in its notation.", text("Content.")),
        loops=by_name("By the loop's name.", {"$ref": "#/$defs/loop"}),
        signals=by_name("By the signal's name, such as TIC-101.PV.", record("How far it went.", **extreme)),
        expectations=listing("In the scenario's order.", run_expectation()),
        standing=listing("What is expected of every run.", run_standing()),
        notes=listing("What happened and needs saying.", note()),
        findings=listing("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=switch("Whether it ran and everything expected of it holds."),
        scan_time=record(
            "The PLC's scan with these loops, where the scenario states a scan time.",
            **{name: number("In s.") for name in ScanTime._fields},
        ),
    )


def loop_of_run() -> Schema:
    """What became of a loop."""
    from pidcfg.sim.judgement.meters import METRICS
    from pidcfg.sim.judgement.report import WORDS_OF_VERDICTS as VERDICTS

    measured = "In s, % of the step or the PV's unit; null where there is none."
    return record(
        "What became of a loop.",
        ("autotune", "until"),
        verdict=text("Whether the run proves that the loop controls.", *VERDICTS),
        missing=or_null(text("What keeps it from being proven.")),
        metrics=record("How well it did.", **{name: or_null(number(measured)) for name in METRICS}),
        until=number("When an event ended overshoot, settling and rise time of the last step, in s, if one did."),
        time_in_control=number("How long it was in Auto or Cascade, in s."),
        alarms=listing("In order of time.", alarm()),
        modes=listing("Modes reached, and requests refused.", mode()),
        flags=by_name("Whether a flag was on at any time.", switch("On at any time.")),
        unlisted=count("Changes that the lists leave out."),
        autotune=record(
            "Where a tuning was started.",
            ("rule",),
            rule=text("What the results rest on, where no manual prints the PLC's rule."),
            done=switch("Whether it came to its end."),
            error=switch("Whether it failed."),
            status=text("In the PLC's words."),
            results=by_name("By the vendor's names.", number("What was found.")),
        ),
    )


def alarm() -> Schema:
    """An alarm of a loop."""
    return record(
        "An alarm.",
        alarm=text("Its name."),
        at=number("When it came, in s."),
        cleared=or_null(number("When it went; null: still on at the end.")),
    )


def mode() -> Schema:
    """A change of mode, or its refusal."""
    return record(
        "A mode reached; after a refusal the old one.",
        at=number("When, in s."),
        requested=or_null(text("What was asked for.")),
        mode=text("What is."),
        reason=or_null(text("Why.")),
    )


def run_expectation() -> Schema:
    """An expectation and its verdict."""
    return record(
        "An expectation.",
        text=text("In words."),
        passed=switch("Whether it holds."),
        value=anything("What was measured."),
    )


def run_standing() -> Schema:
    """A standing expectation and its verdict."""
    from pidcfg.sim.judgement.report import ACCEPTED_KIND, ASSUMED_KIND, STANDING_KINDS
    from pidcfg.sim.judgement.report import WORDS_OF_VERDICTS as VERDICTS

    return record(
        "What is checked in every run.",
        kind=text("What it is about.", *STANDING_KINDS, ACCEPTED_KIND, ASSUMED_KIND),
        loop=text("The loop; empty: the PLC."),
        passed=switch("Whether it holds; true where nothing is known."),
        judged=switch("Whether the loop is not exempt."),
        verdict=text("What the run shows.", *VERDICTS),
        at=or_null(number("Since when, in s.")),
        text=text("In words; of what is not proven, what is missing; of what is not judged, why not."),
        allowed=or_null(text("The reason for which the scenario allows it to fail.")),
    )


def note() -> Schema:
    """A remark on a run."""
    return record(
        "A remark.",
        at=number("When, in s."),
        loop=or_null(text("The loop that it concerns.")),
        text=text("In words."),
        error=switch("Whether it fails the run."),
    )


# --- Batches of samples -----------------------------------------------------------------------------------------------


def batches_schema() -> Schema:
    """One batch, or a list of them when several scenarios were named."""
    return one_or_several("batch", "batches", batch(), metric=metric(), finding=finding())


def batch() -> Schema:
    """One batch; what has not run has nulls and empty lists."""
    from pidcfg.sim.judgement.meters import METRICS

    return record(
        "One scenario; shares and bounds are in %.",
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        samples=count("How many were run."),
        seed=or_null({"type": "integer", "description": "Of the row of samples."}),
        all_passed=count("Samples in which everything holds."),
        failed_to_run=count("Samples that could not run, or had an error on their way; they count as failed."),
        reasons=listing("Why the first of them could not run.", text("Sample and reason.")),
        expectations=listing("In the scenario's order.", batch_expectation()),
        metrics=by_name(
            "By the loop's name.",
            record("By metric.", **{name: {"$ref": "#/$defs/metric"} for name in METRICS}),
        ),
        standing=listing("What is expected of every sample.", batch_standing()),
        uncertainties=listing("Those first that matter most.", uncertainty()),
        worst=listing("The samples nearest to their limits or beyond, the worst first.", worst()),
        findings=listing("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=switch("Whether every bound reaches what is wanted."),
    )


def batch_expectation() -> Schema:
    """An expectation of the scenario."""
    return record(
        "One expectation.",
        text=text("In words."),
        share=number("Samples that keep it."),
        bound=number("What the share is at least, at 95 % confidence."),
        wanted=or_null(number("What the bound must reach; null: no sample may fail.")),
        passed=switch("Whether it does."),
    )


def metric() -> Schema:
    """A metric over all samples in which it was measured."""
    from pidcfg.study.certification.certify import QUANTILES

    values = {name: or_null(number("Quantile, as the upper edge of its bin.")) for name in QUANTILES}
    return record(
        "In s, % of the step or the PV's unit; null where no sample measured it.",
        count=count("Samples that measured it."),
        mean=or_null(number("Mean.")),
        min=or_null(number("Smallest.")),
        **values,
        max=or_null(number("Largest.")),
    )


def batch_standing() -> Schema:
    """What is checked in every run."""
    from pidcfg.sim.judgement.report import ASSUMED_KIND, STANDING_KINDS

    return record(
        "What is checked in every run.",
        kind=text("Its kind.", *STANDING_KINDS, ASSUMED_KIND),
        loop=text("The loop; empty: the PLC."),
        failed=count("Samples that fail it, or do not prove it."),
        not_proven=count("Of these the ones that do not prove it."),
        judged=count("Samples in which it was judged."),
        bound=number("What the share of samples that keep it is at least, at 95 % confidence."),
        passed=switch("Whether no sample fails."),
    )


def uncertainty() -> Schema:
    """What varies."""
    share = "Share of samples that pass where it lies in its {} fifth; null: none lies there."
    return record(
        "One uncertain number.",
        name=text("Plant or loop, and key."),
        spread=text("How it is spread."),
        lowest_fifth=or_null(number(share.format("lowest"))),
        highest_fifth=or_null(number(share.format("highest"))),
    )


def worst() -> Schema:
    """A sample near a limit, or beyond it."""
    return record(
        "One sample.",
        sample=count("Its number, from 0."),
        margin=or_null(number("(limit - value) / |limit|, the smallest; null where no number says it.")),
        failed=switch("Whether it fails."),
        expectation=text("The nearest one; empty: a standing one, or it could not run."),
        values=by_name("By plant or loop and key.", number("As drawn.")),
        file=or_null(text("Where its scenario was written.")),
    )


# --- Gains by a tuning rule -------------------------------------------------------------------------------------------

PROCESS = (
    "gain",
    "time_constant",
    "time_constant_2",
    "dead_time",
    "closed_loop",
    "sample_time",
    "ultimate_gain",
    "ultimate_period",
)
PLANT_KEYS = ("gain", "time_constant", "second_time_constant", "time_constant_2", "dead_time")
SURENESS = ("model", "fit", "confidence")
MODELS = ("first-order", "second-order", "integrating")


def gains_schema() -> Schema:
    """What a rule made of a process."""
    from pidcfg.tuning.rules import METHODS

    return record(
        "Gains in engineering units and seconds.",
        ("for", "written", "robust", "loop", "forecast"),
        version=VERSION,
        method=text("The rule.", *METHODS),
        title=text("The rule in words."),
        form=text("The controller.", "P", "PI", "PID"),
        basis=text("The manual's place or the decision."),
        process=process(),
        gain=number("Output units per PV unit."),
        integral_time=or_null(number("In s; null: no integral term.")),
        derivative_time=number("In s."),
        independent=record(
            "The same as independent gains.",
            kp=number("Proportional gain."),
            ki=number("Per s."),
            kd=number("In s."),
        ),
        ms=or_null(number("Maximum sensitivity; null where the loop is unstable or the process not known.")),
        gain_margin=or_null(number("A factor; null also where no gain makes the loop unstable.")),
        phase_margin=or_null(number("In degrees; null also where there is no limit.")),
        stable=or_null(switch("Whether the loop is stable; null where the process is not known.")),
        overshoot_percent=or_null(number("After a step of the set point, the derivative on the PV.")),
        iae_setpoint=or_null(number("Integral of the absolute error after a unit step of the set point.")),
        iae_disturbance=or_null(number("Integral of the absolute error after a unit step at the output.")),
        valid=switch("Whether the process is in the range of the rule."),
        valid_reason=text("The range, and the process's number."),
        heating=or_null(switch("Whether the PV rises with the output; null where the process's gain is not known.")),
        warnings=listing("What the rule's authors warn of.", text("A warning.")),
        identified=identified(),
        for_=for_vendor(),
        written=written(),
        robust=robust(),
        loop=record(
            "What of the loop in a file the gains are made for.",
            sample_time=or_null(number("In s.")),
            filter_time=number("The time constant of the PV's filter, in s; 0: there is none."),
            action=or_null(text("Its action; null: a program decides.")),
            output_span=number("Of the output from 0 to 100 %."),
        ),
        forecast=forecast(),
    )


def forecast() -> Schema:
    """What the figures of the closed loop are of."""
    span = "Both ends."
    return record(
        "What overshoot and IAE are of, where a file is given.",
        ("setpoint", "largest_step", "settles", "hunts", "error_at_the_end", "pv_range", "output_limits"),
        of=text("A run of the words, or the continuous loop.", "words", "continuous loop"),
        why=or_null(text("Why no words ran.")),
        setpoint=listing("Before and after the step.", number("In the PV's unit.")),
        largest_step=number("A step of the set point up to which the output stays within its limits."),
        settles=switch("Whether the PV settles after the step."),
        hunts=switch("Whether what is left of the error counts in the IAE of the run."),
        error_at_the_end=number("How far from its set point the PV stays on average."),
        pv_range=listing(span, number("In the PV's unit.")),
        output_limits=listing(span, number("In the output's unit.")),
    )


def process() -> Schema:
    """The numbers that the rule had, and of an identified process how sure they are."""
    return record(
        "What was given or identified; an integrator has no time constant.",
        (*PROCESS, *SURENESS),
        **{key: number("As given or identified.") for key in PROCESS},
        model=text("The kind of process.", *MODELS),
        fit=number("What the model explains of the answer, in %."),
        confidence=confidence(),
    )


def confidence() -> Schema:
    """How sure the numbers of a recorded step are."""
    return record(
        "95 % confidence, plus or minus so much.",
        ("time_constant_2",),
        gain=number("Of the gain."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s; not less than half the time between samples."),
        time_constant_2=number("In s, where there are two lags."),
    )


def identified() -> Schema:
    """The process that --from-csv identifies."""
    found = record(
        "The process of a recorded step; null without --from-csv.",
        ("time_constant_2",),
        model=text("The kind of process.", *MODELS),
        gain=number("PV units per output unit; of an integrator, per s."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s."),
        time_constant_2=number("In s, where there are two lags."),
        confidence=confidence(),
        drift=number("Of the PV, in its unit per s, taken out of the gain; 0 where none was found."),
        remarks=listing("Which column was taken for what, and what makes the numbers less sure.", text("A remark.")),
        step_at=number("When the output stepped, in s."),
        noise=number("Of the PV, in its unit."),
        misfit_percent=number("What the model leaves unexplained."),
    )
    return or_null(found)


def robust() -> Schema:
    """What holds on which plants."""
    ends = record("Amounts: a gain without its sign.", low=number("Lower end."), high=number("Upper end."))
    return record(
        "Of the method robust: the sampled loop, on every plant that was tried.",
        ms_limit=number("The limit of the maximum sensitivity."),
        plants=number("How many plants: the process, the combinations of ends, samples."),
        varies=record("What varies.", PLANT_KEYS, **dict.fromkeys(PLANT_KEYS, ends)),
        sample_time=number("Of the loop, in s."),
        pv_share=number("What the filter of the PV takes of a difference in each sample; 1: no filter."),
        worst_ms=number("The largest of all plants."),
        worst_ms_plant=plant(),
        gain_margin=or_null(number("On that plant; null: no limit.")),
        phase_margin=or_null(number("On that plant, in degrees; null: no limit.")),
        worst_iae=number("The largest integral of the absolute error after a unit step at the output."),
        worst_iae_plant=plant(),
        every_word=or_null(switch("Whether all words were tried; null: numbers in floating point.")),
        real=record(
            "The best real numbers.",
            gain=number("Output units per PV unit."),
            integral_time=number("In s."),
            derivative_time=number("In s."),
            worst_iae=number("The largest of all plants."),
            worst_ms=number("The largest of all plants."),
        ),
        cost_percent=number("What the words of the PLC cost against real numbers, in IAE."),
        assumed=listing("What nobody said.", text("In words.")),
        certified=or_null(certified()),
    )


def certified() -> Schema:
    """What the virtual PLC does with samples of the plants."""
    return record(
        "By certify; null: not asked for, or nothing varies.",
        plc=text("The virtual PLC.", *VENDORS),
        samples=number("Samples that ran."),
        held=number("Those with an IAE below the limit, and all that is always checked."),
        at_least_percent=number("What the share of all plants is at least, at 95 % confidence."),
        iae_limit=number("After the step of the load that was run, in PV units and s."),
        iae_max=or_null(number("The largest that was seen.")),
        passed=switch("Whether all samples hold."),
    )


def plant() -> Schema:
    """Numbers of a plant."""
    return record("A plant.", PLANT_KEYS, **{key: number("As tried, a gain without its sign.") for key in PLANT_KEYS})


def written() -> Schema:
    """What --write changes in a configuration."""
    value = record(
        "One of the three numbers.",
        key=text("Its key, seen from the loop."),
        unit=text("Its unit, where the file writes none."),
        old=or_null(text("As it was written; null: it was not given.")),
        new=or_null(text("As it is written now; null: it need not be given.")),
        changes=switch("Whether the text is another one."),
    )
    return record(
        "With --write.",
        file=text("The configuration."),
        loop=text("The name of the loop."),
        ok=switch("Whether no rule finds an error at the loop; else nothing was written."),
        action_compared=switch("Whether the loop's action was compared with the sign of the process's gain."),
        values=listing("Gain, integral and derivative.", value),
        findings=listing("Of the loop with these gains, and what is new elsewhere.", finding()),
    )


def for_vendor() -> Schema:
    """The gains as a PLC holds them, with --for, and with --write."""
    value = record(
        "A parameter.",
        key=text("Its key in the file."),
        unit=text("Its unit."),
        value=number("What was wanted."),
        stored=or_null(number("What the PLC holds; null where it cannot.")),
        error_percent=number("How far that is off."),
        problem=or_null(text("Why it cannot.")),
    )
    return record(
        "With --for, and with --write.",
        vendor=text("The PLC family.", *VENDORS),
        action=or_null(text("The loop's action; null where the process's gain is not known.")),
        values=listing("One a parameter.", value),
    )
