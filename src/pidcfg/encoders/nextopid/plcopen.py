"""A NextoPID program as PLCopen XML (TC6, version 2.01), which CODESYS and its relatives import.

One POU, and the task that calls it: the declarations as ``initialValue/structValue/value[@member]``, the calls as
Structured Text, and in the documentation what no parameter holds. The dates that the format demands are fixed, so
that the same configuration gives the same bytes.
"""

from __future__ import annotations

from decimal import Decimal
from html import escape
from typing import TYPE_CHECKING

from pidcfg.encoders.nextopid.st_program import Unit, unused_name
from pidcfg.encoders.nextopid.st_write import header, statements
from pidcfg.encoders.st.text import literal
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.nextopid.st_program import Variable
    from pidcfg.encoders.parameters import Content, Program
    from pidcfg.schemas.iec import IecType

NAMESPACE = "http://www.plcopen.org/xml/tc6_0201"
XHTML = "http://www.w3.org/1999/xhtml"
DATE = "2000-01-01T00:00:00"
"""A date must stand there, and none means anything."""
ELEMENTARY = frozenset(("BOOL", "REAL", "USINT", "UINT", "UDINT", "INT", "DINT", "TIME"))
TOP = f"""<?xml version="1.0" encoding="utf-8"?>
<project xmlns="{NAMESPACE}">
  <fileHeader companyName="" productName="pidcfg" productVersion="1" creationDateTime="{DATE}" />
  <contentHeader name="{{name}}" modificationDateTime="{DATE}">
    <coordinateInfo>
      <fbd>
        <scaling x="1" y="1" />
      </fbd>
      <ld>
        <scaling x="1" y="1" />
      </ld>
      <sfc>
        <scaling x="1" y="1" />
      </sfc>
    </coordinateInfo>
  </contentHeader>
  <types>
    <dataTypes />
    <pous>
      <pou name="{{name}}" pouType="program">
        <interface>"""
BOTTOM = """      </pou>
    </pous>
  </types>
  <instances>
"""
WITHOUT_TASK = ("<configurations />",)
WITH_TASK = """<configurations>
  <configuration name="Device">
    <resource name="Application">
      <task name="{task}" interval="PT{seconds}S" priority="1">
        <pouInstance name="{name}" typeName="{name}" />
      </task>
    </resource>
  </configuration>
</configurations>"""
"""The names are those that CODESYS gives a new project."""
END = """  </instances>
</project>
"""


def write_plcopen(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as an XML document."""
    unit = Unit(image)
    lines = TOP.replace("{name}", escape(unit.program)).split("\n")
    variables = [line for variable in unit.variables() for line in _variable(variable)]
    if variables:
        lines += ["          <localVars>", *(f"            {line}" for line in variables), "          </localVars>"]
    lines += ["        </interface>", "        <body>", "          <ST>"]
    lines += [_xhtml("\n".join(("", *statements(unit), "")), "            ")]
    lines += ["          </ST>", "        </body>", "        <documentation>"]
    lines += [_xhtml("\n".join(("", *header(image, checklist), "")), "          "), "        </documentation>"]
    return "\n".join(lines) + "\n" + BOTTOM + "".join(f"    {line}\n" for line in _task(unit)) + END


def _task(unit: Unit) -> Sequence[str]:
    """The cyclic task that calls the program; none where nobody says its interval."""
    interval = unit.image.plc.get("sample_time")
    if interval is None:
        return WITHOUT_TASK
    used = {name.upper() for name in (*unit.names.values(), *(block.name for block in unit.layout.instances))}
    task = unused_name("PidTask", used | {unit.program.upper()})
    seconds = decimal_text(Decimal(str(interval)))
    return WITH_TASK.format(task=task, seconds=seconds, name=escape(unit.program)).split("\n")


def _xhtml(text: str, indent: str) -> str:
    return f'{indent}<xhtml xmlns="{XHTML}">{escape(text, quote=False)}</xhtml>'


def _variable(variable: Variable) -> Iterator[str]:
    """A declaration."""
    kind = f"<{variable.type} />" if variable.type in ELEMENTARY else f'<derived name="{escape(variable.type)}" />'
    yield f'<variable name="{escape(variable.name)}">'
    yield from ("  <type>", f"    {kind}", "  </type>")
    if variable.initial is not None:
        yield "  <initialValue>"
        if isinstance(variable.initial, tuple):
            yield f"    {_simple(*variable.initial)}"
        else:
            yield from (f"    {line}" for line in _structure(variable.initial))
        yield "  </initialValue>"
    if variable.note:
        yield from ("  <documentation>", _xhtml(variable.note, "    "), "  </documentation>")
    yield "</variable>"


def _structure(initial: Mapping[str, tuple[IecType, Content]]) -> Iterator[str]:
    """Initial values by member; members of a structure inside it have a dot in their names."""
    yield "<structValue>"
    inside = ""
    for name, value in initial.items():
        first, _, rest = name.rpartition(".")
        if inside and inside != first:
            yield from ("    </structValue>", "  </value>")
        if first and inside != first:
            yield from (f'  <value member="{escape(first)}">', "    <structValue>")
        inside, pad = first, "      " if first else "  "
        yield from (f'{pad}<value member="{escape(rest)}">', f"{pad}  {_simple(*value)}", f"{pad}</value>")
    if inside:
        yield from ("    </structValue>", "  </value>")
    yield "</structValue>"


def _simple(kind: IecType, content: Content) -> str:
    return f'<simpleValue value="{escape(literal(kind, content))}" />'
