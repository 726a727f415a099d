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
    if name in OUTPUT_SCHEMAS:
        return output_schema(name)
    from pidcfg.schemas.document import json_schema

    return json_schema(_model_of(name), name, _title_of(name))


def _model_of(name: str) -> type[BaseModel]:
    if name == SCENARIO:
        from pidcfg.schemas.scenario import Scenario

        return Scenario
    return VENDORS[name].model


def _title_of(name: str) -> str:
    return "pidcfg scenario" if name == SCENARIO else f"pidcfg configuration for {VENDORS[name].title}"


# --- Templates: parts of loops, in which nothing is required, and loops that use one ----------------------------------

PART_ENDING = "Part"
"""Behind the name of a definition: the same with nothing required."""
REFERENCE_PREFIX = "#/$defs/"
TEMPLATES_TEXT = (
    "What equal loops have in common, by a name of its own: a loop with `use: NAME` has all of it, and what it writes "
    "itself wins. A template may use another one."
)
USE_TEXT = "The template whose values the loop has; what the loop writes itself wins, lists as a whole."


def with_templates(schema: Schema) -> Schema:
    """The schema of a configuration file whose loops may use templates."""
    loops = schema["properties"]["loops"]
    loop_items = loops["items"]
    template_schema = _relax(deepcopy(loop_items))
    loop_definitions = {ref.removeprefix(REFERENCE_PREFIX) for ref in _references(loop_items)}
    definitions = {f"{name}{PART_ENDING}": _relax(deepcopy(definition)) for name, definition in schema["$defs"].items()}
    for name in loop_definitions:
        definitions[f"{name}{PART_ENDING}"]["properties"]["use"] = {"type": "string", "description": USE_TEXT}
    schema["$defs"] |= definitions
    loops["items"] = {
        "if": {"required": ["use"]},
        "then": {"allOf": [{"required": ["name"]}, template_schema]},
        "else": loop_items,
    }
    templates = {"type": "object", "description": TEMPLATES_TEXT, "additionalProperties": template_schema}
    schema["properties"] = {"templates": templates, **schema["properties"]}
    return schema


def _relax(value: Any) -> Any:
    """A schema in which nothing is required, all the way down; it has no title, or an editor would show both."""
    if isinstance(value, list):
        return [_relax(item) for item in value]
    if not isinstance(value, dict):
        return value
    if "discriminator" in value and "oneOf" in value:
        return {"anyOf": [_relax(kind) for kind in value["oneOf"]]}
    return {
        key: f"{item}{PART_ENDING}" if key == "$ref" else _relax(item)
        for key, item in value.items()
        if not (key == "required" and isinstance(item, list)) and not (key == "title" and isinstance(item, str))
    }


def _references(value: Schema) -> list[str]:
    """The definitions of an item: one, or the choices of several."""
    if "$ref" in value:
        return [value["$ref"]]
    return [kind["$ref"] for kind in value.get("oneOf", ()) if "$ref" in kind]


# --- What the commands print as JSON: every object lists all of its keys ----------------------------------------------

SCHEMA_DIALECT = "https://json-schema.org/draft/2020-12/schema"
OUTPUT_SCHEMAS = {
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
    function, command = OUTPUT_SCHEMAS[name]
    title = f"What pidcfg {command} prints, version 1"
    layout: Schema = globals()[function]()
    return {"$schema": SCHEMA_DIALECT, "title": title, **layout}


# --- What the schemas are put together from ---------------------------------------------------------------------------

Schema = dict[str, Any]
VERSION_SCHEMA: Schema = {"const": 1, "description": "The version of this layout."}


def object_of(description: str, optional: tuple[str, ...] = (), /, **keys: Schema) -> Schema:
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


def mapping_of(description: str, value: Schema) -> Schema:
    """An object whose keys are names of the user's files."""
    return {"description": description, "type": "object", "additionalProperties": value}


def list_of(description: str, item: Schema) -> Schema:
    """A list."""
    return {"description": description, "type": "array", "items": item}


def text(description: str, *choices: str) -> Schema:
    """Text, or one of some words."""
    return {"description": description, **({"enum": list(choices)} if choices else {"type": "string"})}


def number(description: str) -> Schema:
    """A number."""
    return {"description": description, "type": "number"}


def integer(description: str, minimum: int = 0) -> Schema:
    """A whole number."""
    return {"description": description, "type": "integer", "minimum": minimum}


def flag(description: str) -> Schema:
    """True or false."""
    return {"description": description, "type": "boolean"}


def or_null(schema: Schema) -> Schema:
    """The same, or null where there is none."""
    if "enum" in schema:
        return {**schema, "enum": [*schema["enum"], None]}
    return {**schema, "type": [schema["type"], "null"]}


def any_value(description: str) -> Schema:
    """A value as the user's file or the PLC has it."""
    return {"description": description, "type": ["null", "boolean", "number", "string", "array"]}


def scenarios_schema(name: str, plural: str, single: Schema, **parts: Schema) -> Schema:
    """What stands alone for one scenario, and for several in a list; ``parts``: its parts."""
    list_schema = object_of(
        "Several scenarios.",
        version=VERSION_SCHEMA,
        **{plural: list_of("One a scenario.", {"$ref": f"#/$defs/{name}"})},
        passed=flag(f"Whether every {name} passed."),
    )
    single_schema = {
        **single,
        "properties": {"version": VERSION_SCHEMA, **single["properties"]},
        "required": ["version", *single["required"]],
    }
    return {"oneOf": [single_schema, list_schema], "$defs": {name: single, **parts}}


# --- Findings, as ``validate`` prints them, and the others when they cannot use a file --------------------------------


def findings_schema() -> Schema:
    """All findings, and how many there are."""
    return object_of(
        "What was found in all files.",
        version=VERSION_SCHEMA,
        findings=list_of("By file and place.", finding_row()),
        summary=object_of(
            "How many files were looked at, and how many findings of each kind are listed.",
            files=integer("Files that were looked at."),
            errors=integer("Findings that fail the run."),
            warnings=integer("Findings that fail it under --strict."),
            infos=integer("What is worth knowing."),
        ),
    )


def finding_row() -> Schema:
    """One finding."""
    return object_of(
        "One finding.",
        code={
            "description": "The rule; pidcfg rule CODE explains it.",
            "type": "string",
            "pattern": "^[A-Z]{2,3}[0-9]{3}$",
        },
        severity=text("How bad it is.", *(severity.label for severity in reversed(Severity))),
        message=text("What is wrong, with the value."),
        file=text("The file as it was named, with forward slashes; <stdin> for standard input."),
        line=integer("Where the value is written; the first line is 1.", 1),
        column=integer("The first column is 1; columns are Unicode code points.", 1),
        end_line=integer("The line in which the value ends.", 1),
        end_column=integer("The column behind its last character.", 1),
        path=text("The key, such as loops[1].tuning.reset; empty for the file as a whole."),
        loop=text("The loop that it concerns; empty where it concerns none."),
        with_=list_of("The other loops of the same fault; each has a finding that names this one.", text("A loop.")),
        plc_effect=or_null(text("What the PLC would do.")),
        reference=or_null(text("The place in the manual, or the decision, that the rule rests on.")),
        help=or_null(text("The cure.")),
        url=text("The rule's page: an address, or seen from the root of the documentation site where it has none."),
    )


# --- Findings counted by their rules ----------------------------------------------------------------------------------


def counts_schema() -> Schema:
    """How often each rule has something to say."""
    fields = finding_row()["properties"]
    row = object_of(
        "A rule, with one severity.",
        code=fields["code"],
        severity=fields["severity"],
        title=text("What is wrong."),
        count=integer("Findings.", 1),
        fixable=integer("Those that --fix corrects."),
    )
    return object_of(
        "Findings by rule.",
        version=VERSION_SCHEMA,
        statistics=list_of("The most frequent first.", row),
        summary=findings_schema()["properties"]["summary"],
    )


# --- The documentation of rules ---------------------------------------------------------------------------------------


def rules_schema() -> Schema:
    """One rule, or a list of them."""
    fields = finding_row()["properties"]
    rule = object_of(
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
    single_schema = {
        **rule,
        "properties": {"version": VERSION_SCHEMA, **rule["properties"]},
        "required": ["version", *rule["required"]],
    }
    list_schema = object_of("Several rules.", version=VERSION_SCHEMA, rules=list_of("By code.", rule))
    return {"oneOf": [single_schema, list_schema]}


# --- The PLC's memory -------------------------------------------------------------------------------------------------

CONTENT_SCHEMA: Schema = {"description": "As the vendor shows it.", "type": ["boolean", "number"]}
OPEN_SCHEMA: Schema = {"description": "In the terms of the vendor.", "type": "object", "additionalProperties": True}


def words_schema() -> Schema:
    """Every word; or findings, when the file cannot be encoded."""
    image = object_of(
        "The PLC's memory for a configuration.",
        version=VERSION_SCHEMA,
        vendor=text("The PLC family.", *VENDORS),
        words=list_of("In the order of addresses.", {"oneOf": [register_row(), parameter_row(), wired_row()]}),
        settings=list_of("What no register holds, an object a loop.", OPEN_SCHEMA),
        plc=OPEN_SCHEMA,
        checklist=list_of("What a person should check after the download.", text("An item.")),
    )
    return {"oneOf": [image, findings_schema()]}


def register_row() -> Schema:
    """A register with an address."""
    return object_of(
        "A register.",
        address=text("As the vendor writes it."),
        value=CONTENT_SCHEMA,
        hex=text("The raw content in hexadecimal digits."),
        loop=or_null(text("The loop that it belongs to.")),
        field=text("What it holds."),
    )


def parameter_row() -> Schema:
    """A parameter with a name."""
    return object_of(
        "A parameter.",
        ("device",),
        **_parameter_keys(),
        value={**CONTENT_SCHEMA, "type": ["boolean", "number", "string"]},
    )


def wired_row() -> Schema:
    """A parameter that follows an expression."""
    return object_of(
        "A parameter that follows others.", ("device",), **_parameter_keys(), expression=text("What it follows.")
    )


def _parameter_keys() -> dict[str, Schema]:
    from pidcfg.encoders.parameters import TYPES

    return {
        "address": text("Its name."),
        "type": text("Its type.", *TYPES),
        "device": text("Its place in the PLC, where it has one."),
        "loop": or_null(text("The loop or block that it belongs to.")),
        "field": text("What it holds."),
    }


# --- The verdict of the battery ---------------------------------------------------------------------------------------


def verdict_row() -> Schema:
    """One loop's verdict."""
    return object_of(
        "A loop.",
        loop=text("Its name."),
        passed=flag("Whether the target does what the source's numbers do under its rules."),
        pv_percent=number("The PVs at most apart in the step and the disturbance, in % of the range."),
        output_percent=number("The outputs at most."),
        iae_ratio=or_null(number("Integral of the absolute error, after to before.")),
        stages=list_of("Those that were run.", text("Its name.")),
        not_tried=list_of(
            "Those in which the source does not go to a mode that is asked of it.",
            object_of("A stage.", stage=text("Its name."), mode=text("The mode.")),
        ),
        differences=list_of(
            "What nothing explains.", signal_difference(key=or_null(text("The key that explains it.")))
        ),
        named=list_of(
            "Where source and target differ, as a line of the report says.",
            signal_difference(
                line=or_null(text("The field of the line; null where several lines do it together.")),
                note=text("What it says; may be empty."),
            ),
        ),
        run_with=list_of(
            "What the source's numbers were run with: values and rules of the target.",
            object_of("A line of the report.", line=text("Its field."), to=any_value("What the target has.")),
        ),
        not_shown=list_of("Numbers of which no stage can tell another value.", text("The field of the neutral form.")),
    )


def signal_difference(**more: Schema) -> Schema:
    """A signal that differs in a stage."""
    return object_of(
        "A signal in a stage.",
        stage=text("Its name."),
        signal=text("pv, output, setpoint, mode, run, or the name of an alarm."),
        at=number("The first time, in s from the beginning of the stage."),
        from_=any_value("What the first side shows then; outputs as shares of the range."),
        to=any_value("What the second side shows."),
        percent=or_null(number("How far a number lies apart at most, in % of its range.")),
        **more,
    )


# --- The report of a conversion ---------------------------------------------------------------------------------------


def conversion_schema() -> Schema:
    """What became of every field; or findings, when the file cannot be converted."""
    report = object_of(
        "What became of every field.",
        ("verify",),
        version=VERSION_SCHEMA,
        from_=text("The PLC family of the file.", *VENDORS),
        to=text("The PLC family that it was converted to.", *VENDORS),
        loops=list_of(
            "One a loop.",
            object_of(
                "A loop.",
                loop=text("Its name."),
                status=text("Whether it went over.", "converted", "dropped"),
                reason=or_null(text("Why it was dropped.")),
                changes=list_of("Of all fields.", change_row()),
            ),
        ),
        findings=list_of("What the target's own rules find at fault in the result.", finding_row()),
        verify=list_of("With --verify: the verdict of the battery.", verdict_row()),
    )
    return {"oneOf": [report, findings_schema()]}


def change_row() -> Schema:
    """What became of a field."""
    from pidcfg.conversion import KINDS_BY_HARM

    return object_of(
        "What became of a field.",
        field=text("Its key; in the source where that has one, else in the result."),
        target_field=or_null(text("Its key in the result.")),
        kind=text("From harmless to harmful.", *KINDS_BY_HARM),
        from_=any_value("The value before."),
        to=any_value("The value after."),
        error_percent=number("How far the value that acts is off."),
        counts_apart=number("Of an exact number: how far the words of both sides are apart, in the coarser counts."),
        loss=flag("Whether it needs leave: dropped, clamped, or rounded beyond --max-loss."),
        neutral=or_null(
            object_of(
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

    counts = {risk: integer("Differences of this risk.") for risk in RISKS}
    counts |= {status: integer("Loops of this status.") for status in get_args(Status)}
    report = object_of(
        "How two configurations differ.",
        ("verify",),
        version=VERSION_SCHEMA,
        from_=text("The first file."),
        to=text("The second file."),
        loops=list_of("One a loop; one without a name is the rest of the file.", compared_loop()),
        summary=object_of("How many there are.", **counts),
        notes=list_of("What a listing did not say, or could not be read of it.", text("A note.")),
        verify=list_of("With --verify: the verdict of the battery.", verdict_row()),
    )
    return {"oneOf": [report, findings_schema()]}


def compared_loop() -> Schema:
    """A loop on both sides, or on one."""
    from pidcfg.conversion.differences import Status

    place_schema = object_of("Where its registers begin.", from_=text("Before."), to=text("After."))
    return object_of(
        "A loop.",
        loop=text("Its name; empty: what belongs to no loop."),
        status=text("What became of it; one that is renamed or moved may have differences.", *get_args(Status)),
        was=or_null(text("Its name before, where it is another one.")),
        moved=or_null(place_schema),
        differences=list_of("The gravest first.", key_difference()),
        operated=list_of("What the operator sets; no difference.", key_difference()),
        left_out=list_of("Keys of words that differ and that the PLC or the process writes.", text("A key.")),
        missing=list_of("Keys that a listing does not hold.", text("A key.")),
        states=list_of("What a listing says of a loop that does not run as it is set up.", loop_state()),
    )


def loop_state() -> Schema:
    """An error, a stop or an auto-tune that a word tells of."""
    from pidcfg.conversion.differences import StateKind

    return object_of(
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

    return object_of(
        "A key that differs.",
        field=text("The field of the neutral form, else the key."),
        key=or_null(text("The key of the file; null between two vendors.")),
        risk=text("What can go wrong.", *RISKS),
        from_=any_value("The value before; null: not given."),
        to=any_value("The value after; null: not given."),
        unit=text("The unit of both values; may be empty."),
        address=or_null(text("The register; null: none holds it.")),
        word_from=or_null(text("The content of the register before, as the PLC shows it.")),
        word_to=or_null(text("The content after.")),
        note=text("What it means; may be empty."),
    )


# --- Runs of scenarios ------------------------------------------------------------------------------------------------


def runs_schema() -> Schema:
    """One run, or a list of them when several scenarios were named."""
    return scenarios_schema("run", "runs", run_object(), loop=loop_of_run(), finding=finding_row())


def run_object() -> Schema:
    """One run; what has not run has nulls and empty lists."""
    from pidcfg.sim.judgement.report import ScanTime

    extreme = {key: number(f"Signal's {key}.") for key in ("min", "max", "final")}
    return object_of(
        "One scenario.",
        ("scan_time",),
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        engine=or_null(text("What calculated it.", "python", "numba")),
        plc_flags=mapping_of("Error registers of the PLC in its notation.", text("Content.")),
        loops=mapping_of("By the loop's name.", {"$ref": "#/$defs/loop"}),
        signals=mapping_of("By the signal's name, such as TIC-101.PV.", object_of("How far it went.", **extreme)),
        expectations=list_of("In the scenario's order.", run_expectation()),
        standing=list_of("What is expected of every run.", run_standing()),
        notes=list_of("What happened and needs saying.", note_row()),
        findings=list_of("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=flag("Whether it ran and everything expected of it holds."),
        scan_time=object_of(
            "The PLC's scan with these loops, where the scenario states a scan time.",
            **{name: number("In s.") for name in ScanTime._fields},
        ),
    )


def loop_of_run() -> Schema:
    """What became of a loop."""
    from pidcfg.sim.judgement.meters import METRICS
    from pidcfg.sim.judgement.report import VERDICT_WORDS as VERDICTS

    metric_text = "In s, % of the step or the PV's unit; null where there is none."
    return object_of(
        "What became of a loop.",
        ("autotune", "until"),
        verdict=text("Whether the run proves that the loop controls.", *VERDICTS),
        missing=or_null(text("What keeps it from being proven.")),
        metrics=object_of("How well it did.", **{name: or_null(number(metric_text)) for name in METRICS}),
        until=number("When an event ended overshoot, settling and rise time of the last step, in s, if one did."),
        time_in_control=number("How long it was in Auto or Cascade, in s."),
        alarms=list_of("In order of time.", alarm_row()),
        modes=list_of("Modes reached, and requests refused.", mode_row()),
        flags=mapping_of("Whether a flag was on at any time.", flag("On at any time.")),
        unlisted=integer("Changes that the lists leave out."),
        autotune=object_of(
            "Where a tuning was started.",
            ("rule",),
            rule=text("What the results rest on, where no manual prints the PLC's rule."),
            done=flag("Whether it came to its end."),
            error=flag("Whether it failed."),
            status=text("In the PLC's words."),
            results=mapping_of("By the vendor's names.", number("What was found.")),
        ),
    )


def alarm_row() -> Schema:
    """An alarm of a loop."""
    return object_of(
        "An alarm.",
        alarm=text("Its name."),
        at=number("When it came, in s."),
        cleared=or_null(number("When it went; null: still on at the end.")),
    )


def mode_row() -> Schema:
    """A change of mode, or its refusal."""
    return object_of(
        "A mode reached; after a refusal the old one.",
        at=number("When, in s."),
        requested=or_null(text("What was asked for.")),
        mode=text("What is."),
        reason=or_null(text("Why.")),
    )


def run_expectation() -> Schema:
    """An expectation and its verdict."""
    return object_of(
        "An expectation.",
        text=text("In words."),
        passed=flag("Whether it holds."),
        value=any_value("What was measured."),
    )


def run_standing() -> Schema:
    """A standing expectation and its verdict."""
    from pidcfg.sim.judgement.report import ACCEPTED_KIND, ASSUMED_KIND, STANDING_KINDS
    from pidcfg.sim.judgement.report import VERDICT_WORDS as VERDICTS

    return object_of(
        "What is checked in every run.",
        kind=text("What it is about.", *STANDING_KINDS, ACCEPTED_KIND, ASSUMED_KIND),
        loop=text("The loop; empty: the PLC."),
        passed=flag("Whether it holds; true where nothing is known."),
        judged=flag("Whether the loop is not exempt."),
        verdict=text("What the run shows.", *VERDICTS),
        at=or_null(number("Since when, in s.")),
        text=text("In words; of what is not proven, what is missing; of what is not judged, why not."),
        allowed=or_null(text("The reason for which the scenario allows it to fail.")),
    )


def note_row() -> Schema:
    """A remark on a run."""
    return object_of(
        "A remark.",
        at=number("When, in s."),
        loop=or_null(text("The loop that it concerns.")),
        text=text("In words."),
        error=flag("Whether it fails the run."),
    )


# --- Batches of samples -----------------------------------------------------------------------------------------------


def batches_schema() -> Schema:
    """One batch, or a list of them when several scenarios were named."""
    return scenarios_schema("batch", "batches", batch_object(), metric=metric_object(), finding=finding_row())


def batch_object() -> Schema:
    """One batch; what has not run has nulls and empty lists."""
    from pidcfg.sim.judgement.meters import METRICS

    return object_of(
        "One scenario; shares and bounds are in %.",
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        samples=integer("How many were run."),
        seed=or_null({"type": "integer", "description": "Of the row of samples."}),
        all_passed=integer("Samples in which everything holds."),
        failed_to_run=integer("Samples that could not run, or had an error on their way; they count as failed."),
        reasons=list_of("Why the first of them could not run.", text("Sample and reason.")),
        expectations=list_of("In the scenario's order.", batch_expectation()),
        metrics=mapping_of(
            "By the loop's name.",
            object_of("By metric.", **{name: {"$ref": "#/$defs/metric"} for name in METRICS}),
        ),
        standing=list_of("What is expected of every sample.", batch_standing()),
        uncertainties=list_of("Those first that matter most.", uncertainty_row()),
        worst=list_of("The samples nearest to their limits or beyond, the worst first.", worst_sample_row()),
        findings=list_of("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=flag("Whether every bound reaches what is wanted."),
    )


def batch_expectation() -> Schema:
    """An expectation of the scenario."""
    return object_of(
        "One expectation.",
        text=text("In words."),
        share=number("Samples that keep it."),
        bound=number("What the share is at least, at 95 % confidence."),
        wanted=or_null(number("What the bound must reach; null: no sample may fail.")),
        passed=flag("Whether it does."),
    )


def metric_object() -> Schema:
    """A metric over all samples in which it was measured."""
    from pidcfg.study.certification.certify import QUANTILES

    values = {name: or_null(number("Quantile, as the upper edge of its bin.")) for name in QUANTILES}
    return object_of(
        "In s, % of the step or the PV's unit; null where no sample measured it.",
        count=integer("Samples that measured it."),
        mean=or_null(number("Mean.")),
        min=or_null(number("Smallest.")),
        **values,
        max=or_null(number("Largest.")),
    )


def batch_standing() -> Schema:
    """What is checked in every run."""
    from pidcfg.sim.judgement.report import ASSUMED_KIND, STANDING_KINDS

    return object_of(
        "What is checked in every run.",
        kind=text("Its kind.", *STANDING_KINDS, ASSUMED_KIND),
        loop=text("The loop; empty: the PLC."),
        failed=integer("Samples that fail it, or do not prove it."),
        not_proven=integer("Of these the ones that do not prove it."),
        judged=integer("Samples in which it was judged."),
        bound=number("What the share of samples that keep it is at least, at 95 % confidence."),
        passed=flag("Whether no sample fails."),
    )


def uncertainty_row() -> Schema:
    """What varies."""
    share_text = "Share of samples that pass where it lies in its {} fifth; null: none lies there."
    return object_of(
        "One uncertain number.",
        name=text("Plant or loop, and key."),
        spread=text("How it is spread."),
        lowest_fifth=or_null(number(share_text.format("lowest"))),
        highest_fifth=or_null(number(share_text.format("highest"))),
    )


def worst_sample_row() -> Schema:
    """A sample near a limit, or beyond it."""
    return object_of(
        "One sample.",
        sample=integer("Its number, from 0."),
        margin=or_null(number("(limit - value) / |limit|, the smallest; null where no number says it.")),
        failed=flag("Whether it fails."),
        expectation=text("The nearest one; empty: a standing one, or it could not run."),
        values=mapping_of("By plant or loop and key.", number("As drawn.")),
        file=or_null(text("Where its scenario was written.")),
    )


# --- Gains by a tuning rule -------------------------------------------------------------------------------------------

PROCESS_KEYS = (
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
FIT_KEYS = ("model", "fit", "confidence")
MODEL_NAMES = ("first-order", "second-order", "integrating")


def gains_schema() -> Schema:
    """What a rule made of a process."""
    from pidcfg.tuning.rules import METHODS

    return object_of(
        "Gains in engineering units and seconds.",
        ("for", "written", "robust", "loop", "forecast"),
        version=VERSION_SCHEMA,
        method=text("The rule.", *METHODS),
        title=text("The rule in words."),
        form=text("The controller.", "P", "PI", "PID"),
        basis=text("The manual's place or the decision."),
        process=process_object(),
        gain=number("Output units per PV unit."),
        integral_time=or_null(number("In s; null: no integral term.")),
        derivative_time=number("In s."),
        independent=object_of(
            "The same as independent gains.",
            kp=number("Proportional gain."),
            ki=number("Per s."),
            kd=number("In s."),
        ),
        ms=or_null(number("Maximum sensitivity; null where the loop is unstable or the process not known.")),
        gain_margin=or_null(number("A factor; null also where no gain makes the loop unstable.")),
        phase_margin=or_null(number("In degrees; null also where there is no limit.")),
        stable=or_null(flag("Whether the loop is stable; null where the process is not known.")),
        overshoot_percent=or_null(number("After a step of the set point, the derivative on the PV.")),
        iae_setpoint=or_null(number("Integral of the absolute error after a unit step of the set point.")),
        iae_disturbance=or_null(number("Integral of the absolute error after a unit step at the output.")),
        valid=flag("Whether the process is in the range of the rule."),
        valid_reason=text("The range, and the process's number."),
        heating=or_null(flag("Whether the PV rises with the output; null where the process's gain is not known.")),
        warnings=list_of("What the rule's authors warn of.", text("A warning.")),
        identified=identified_object(),
        for_=for_vendor(),
        written=written_object(),
        robust=robust_object(),
        loop=object_of(
            "What of the loop in a file the gains are made for.",
            sample_time=or_null(number("In s.")),
            filter_time=number("The time constant of the PV's filter, in s; 0: there is none."),
            action=or_null(text("Its action; null: a program decides.")),
            output_span=number("Of the output from 0 to 100 %."),
        ),
        forecast=forecast_object(),
    )


def forecast_object() -> Schema:
    """What the figures of the closed loop are of."""
    span = "Both ends."
    return object_of(
        "What overshoot and IAE are of, where a file is given.",
        ("setpoint", "largest_step", "settles", "hunts", "error_at_the_end", "pv_range", "output_limits"),
        of=text("A run of the words, or the continuous loop.", "words", "continuous loop"),
        why=or_null(text("Why no words ran.")),
        setpoint=list_of("Before and after the step.", number("In the PV's unit.")),
        largest_step=number("A step of the set point up to which the output stays within its limits."),
        settles=flag("Whether the PV settles after the step."),
        hunts=flag("Whether what is left of the error counts in the IAE of the run."),
        error_at_the_end=number("How far from its set point the PV stays on average."),
        pv_range=list_of(span, number("In the PV's unit.")),
        output_limits=list_of(span, number("In the output's unit.")),
    )


def process_object() -> Schema:
    """The numbers that the rule had, and of an identified process how sure they are."""
    return object_of(
        "What was given or identified; an integrator has no time constant.",
        (*PROCESS_KEYS, *FIT_KEYS),
        **{key: number("As given or identified.") for key in PROCESS_KEYS},
        model=text("The kind of process.", *MODEL_NAMES),
        fit=number("What the model explains of the answer, in %."),
        confidence=confidence_object(),
    )


def confidence_object() -> Schema:
    """How sure the numbers of a recorded step are."""
    return object_of(
        "95 % confidence, plus or minus so much.",
        ("time_constant_2",),
        gain=number("Of the gain."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s; not less than half the time between samples."),
        time_constant_2=number("In s, where there are two lags."),
    )


def identified_object() -> Schema:
    """The process that --from-csv identifies."""
    process = object_of(
        "The process of a recorded step; null without --from-csv.",
        ("time_constant_2",),
        model=text("The kind of process.", *MODEL_NAMES),
        gain=number("PV units per output unit; of an integrator, per s."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s."),
        time_constant_2=number("In s, where there are two lags."),
        confidence=confidence_object(),
        drift=number("Of the PV, in its unit per s, taken out of the gain; 0 where none was found."),
        remarks=list_of("Which column was taken for what, and what makes the numbers less sure.", text("A remark.")),
        step_at=number("When the output stepped, in s."),
        noise=number("Of the PV, in its unit."),
        misfit_percent=number("What the model leaves unexplained."),
    )
    return or_null(process)


def robust_object() -> Schema:
    """What holds on which plants."""
    ends = object_of("Amounts: a gain without its sign.", low=number("Lower end."), high=number("Upper end."))
    return object_of(
        "Of the method robust: the sampled loop, on every plant that was tried.",
        ms_limit=number("The limit of the maximum sensitivity."),
        plants=number("How many plants: the process, the combinations of ends, samples."),
        varies=object_of("What varies.", PLANT_KEYS, **dict.fromkeys(PLANT_KEYS, ends)),
        sample_time=number("Of the loop, in s."),
        pv_share=number("What the filter of the PV takes of a difference in each sample; 1: no filter."),
        worst_ms=number("The largest of all plants."),
        worst_ms_plant=plant_object(),
        gain_margin=or_null(number("On that plant; null: no limit.")),
        phase_margin=or_null(number("On that plant, in degrees; null: no limit.")),
        worst_iae=number("The largest integral of the absolute error after a unit step at the output."),
        worst_iae_plant=plant_object(),
        every_word=or_null(flag("Whether all words were tried; null: numbers in floating point.")),
        real=object_of(
            "The best real numbers.",
            gain=number("Output units per PV unit."),
            integral_time=number("In s."),
            derivative_time=number("In s."),
            worst_iae=number("The largest of all plants."),
            worst_ms=number("The largest of all plants."),
        ),
        cost_percent=number("What the words of the PLC cost against real numbers, in IAE."),
        assumed=list_of("What nobody said.", text("In words.")),
        certified=or_null(certified_object()),
    )


def certified_object() -> Schema:
    """What the virtual PLC does with samples of the plants."""
    return object_of(
        "By certify; null: not asked for, or nothing varies.",
        plc=text("The virtual PLC.", *VENDORS),
        samples=number("Samples that ran."),
        held=number("Those with an IAE below the limit, and all that is always checked."),
        at_least_percent=number("What the share of all plants is at least, at 95 % confidence."),
        iae_limit=number("After the step of the load that was run, in PV units and s."),
        iae_max=or_null(number("The largest that was seen.")),
        passed=flag("Whether all samples hold."),
    )


def plant_object() -> Schema:
    """Numbers of a plant."""
    return object_of(
        "A plant.", PLANT_KEYS, **{key: number("As tried, a gain without its sign.") for key in PLANT_KEYS}
    )


def written_object() -> Schema:
    """What --write changes in a configuration."""
    value = object_of(
        "One of the three numbers.",
        key=text("Its key, seen from the loop."),
        unit=text("Its unit, where the file writes none."),
        old=or_null(text("As it was written; null: it was not given.")),
        new=or_null(text("As it is written now; null: it need not be given.")),
        changes=flag("Whether the text is another one."),
    )
    return object_of(
        "With --write.",
        file=text("The configuration."),
        loop=text("The name of the loop."),
        ok=flag("Whether no rule finds an error at the loop; else nothing was written."),
        action_compared=flag("Whether the loop's action was compared with the sign of the process's gain."),
        values=list_of("Gain, integral and derivative.", value),
        findings=list_of("Of the loop with these gains, and what is new elsewhere.", finding_row()),
    )


def for_vendor() -> Schema:
    """The gains as a PLC holds them, with --for, and with --write."""
    value = object_of(
        "A parameter.",
        key=text("Its key in the file."),
        unit=text("Its unit."),
        value=number("What was wanted."),
        stored=or_null(number("What the PLC holds; null where it cannot.")),
        error_percent=number("How far that is off."),
        problem=or_null(text("Why it cannot.")),
    )
    return object_of(
        "With --for, and with --write.",
        vendor=text("The PLC family.", *VENDORS),
        action=or_null(text("The loop's action; null where the process's gain is not known.")),
        values=list_of("One a parameter.", value),
    )
