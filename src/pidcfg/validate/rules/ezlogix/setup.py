"""What the EZLogix rules look at; where registers, discretes and tags lie, names, and the controller's action.

Values are taken from each loop's own blocks, not read back from the image: where blocks overlap, the image holds only
one of them. Each is worked out once, when the first rule asks for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from functools import cached_property
from itertools import permutations

from pidcfg.encoders.codecs import Scale
from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.maps.ezlogix import BLOCKS, MAX_LOOPS, R_BLOCK, SPACE, TAG_NAME, VARIABLES
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.ezlogix import D152, REGISTERS, EzlogixFile, Loop, tag_name
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path
from pidcfg.text.references import EZLOGIX, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Findings, checklist, error, per_loop, warning
from pidcfg.validate.shared_checks import (
    Context,
    Extent,
    View,
    all_or_none,
    extents_of,
    number_with_unit,
    report_at_both,
)

OFFSETS = {word.name: word.offset for word in R_BLOCK.words}
SETPOINT_OFFSET = OFFSETS["setpoint"]
ROOT_PATHS = (("setpoint", "value"), ("setpoint", "limits", 0), ("setpoint", "limits", 1))
"""Places whose counts mean nothing where the root of counts that do not begin at 0 is taken."""


@frozen
class LoopView(View[Loop]):
    """A loop, its place in the file, and what its registers hold."""

    block: Block

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The scales ``pv``, ``sp`` and ``output``."""
        return scales_of(self.loop.pv, self.loop.output, root=self.loop.pv.square_root)

    @cached_property
    def misfits(self) -> frozenset[str]:
        """The registers that their values do not fit."""
        return frozenset(misfit.word.name for misfit in self.block.encoded.misfits)

    def counts(self, name: str) -> int | None:
        """What a register holds; None when the value does not fit (which another rule reports)."""
        return None if name in self.misfits else self.block.encoded.words[OFFSETS[name]]

    def all_counts(self, *names: str) -> list[int]:
        """What several registers hold; empty as soon as one value does not fit."""
        return all_or_none(map(self.counts, names))

    def register_value(self, name: str) -> Decimal | None:
        """The number that an unscaled register stands for: seconds, or the gain; None when the value does not fit."""
        raw = self.counts(name)
        return None if raw is None else Decimal(R_BLOCK.words[OFFSETS[name]].decode(raw))

    def register_values(self, *names: str) -> list[Decimal]:
        """The numbers of several registers; empty as soon as one does not fit."""
        return all_or_none(map(self.register_value, names))

    def register(self, name: str) -> str:
        """The address of one of the loop's registers: ``R107``."""
        return f"R{self.loop.registers + OFFSETS[name]}"

    def pv_text(self, counts: int) -> str:
        """Counts on the set point's scale as people write them."""
        return quantity_text(self.scales["sp"].value(counts), self.loop.pv.unit)

    def pv_distance(self, counts: int) -> str:
        """A difference on the set point's scale as people write it."""
        return quantity_text(self.scales["sp"].span_value(counts), self.loop.pv.unit)

    def cv_text(self, counts: int) -> str:
        """Counts of the CV as people write them."""
        return quantity_text(self.scales["output"].value(counts), self.loop.output.unit)

    @cached_property
    def extents(self) -> tuple[Extent, ...]:
        """The registers of its two blocks."""
        return extents_of(self.loop, BLOCKS)

    @cached_property
    def setpoint_limits(self) -> tuple[int, int] | None:
        """The set point limits in counts; None where they do not fit or are crossed."""
        limits = self.all_counts("setpoint_low", "setpoint_high")
        return (limits[0], limits[1]) if limits and limits[0] <= limits[1] else None

    @cached_property
    def cv_limits(self) -> tuple[int, int] | None:
        """The CV limits in counts; None where they do not fit or leave no room."""
        limits = self.all_counts("cv_low", "cv_high")
        return (limits[0], limits[1]) if limits and limits[0] < limits[1] else None

    @cached_property
    def setpoint(self) -> int | None:
        """The set point in counts as its limits leave it; None where it does not fit or its limits are crossed."""
        value, limits = self.counts("setpoint"), self.setpoint_limits
        return None if value is None or limits is None else min(max(value, limits[0]), limits[1])

    @cached_property
    def integrates(self) -> bool:
        """Whether there is an integral term."""
        return bool(self.register_value("integral_time"))

    @cached_property
    def pulses(self) -> tuple[Decimal, Decimal, Decimal] | None:
        """Cycle, minimum on and minimum off time in s; None without control output, or where one does not fit."""
        if self.loop.output.pulse is None:
            return None
        times = self.register_values("cycle_time", "min_on", "min_off")
        return (times[0], times[1], times[2]) if times and times[0] > 0 else None


def quantity_text(value: Quantity, unit: str | None) -> str:
    """A quantity with its unit; raw counts say so themselves."""
    return number_with_unit(value.value, "counts" if value.counts else unit)


def register_number(tag: str) -> int | None:
    """The number of an R tag; None for an input or output register, which lies in no block."""
    return int(tag[1:]) if tag.startswith(REGISTERS.prefix) else None


@frozen
class EzlogixContext(Context[EzlogixFile, Encoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        blocks = self.encoding.blocks[:: len(BLOCKS)]
        return tuple(LoopView(i, loop, blocks[i]) for i, loop in enumerate(self.config.loops))

    def block_owner(self, tag: str) -> tuple[LoopView, int] | None:
        """The loop in whose register block a tag lies, and its offset there."""
        number = register_number(tag)
        if number is None:
            return None
        return next(
            (
                (view, number - first)
                for view in self.loops
                for _, _, first, last in view.extents[:1]
                if first <= number <= last
            ),
            None,
        )

    def inner_loop(self, view: LoopView) -> LoopView | None:
        """The loop whose set point register is this loop's CV tag."""
        owner = self.block_owner(view.loop.output.tag)
        return owner[0] if owner is not None and owner[1] == SETPOINT_OFFSET and owner[0] is not view else None

    @cached_property
    def remote_setpoint_loops(self) -> frozenset[int]:
        """The places of loops whose set point another loop's CV writes."""
        inner = (self.inner_loop(view) for view in self.loops)
        return frozenset(view.index for view in inner if view is not None)

    @cached_property
    def explained_paths(self) -> frozenset[Path]:
        """Places whose limits a rule of EZLogix's own explains better than the rules for every vendor."""
        paths: list[Path] = []
        for i, loop in enumerate(self.config.loops):
            if loop.sample_rate == 0:
                paths.append(("loops", i, "sample_rate"))
            if loop.output.pulse is not None and loop.output.pulse.cycle_time == 0:
                paths.append(("loops", i, "output", "pulse", "cycle_time"))
            if loop.pv.square_root and loop.pv.counts is not None and loop.pv.counts[0]:
                paths += [("loops", i, *place) for place in ROOT_PATHS]
        return frozenset(paths)


# --- The blocks of registers and discretes: where they end, what they share, and how many loops there may be ----------

BLOCK = EZLOGIX.cite("PID Setup")
COUNT = EZLOGIX.cite("PID on EZLogix")
LAST_ADDRESSES = {bank.prefix: bank.last for bank in SPACE.banks}


@per_loop
@error(
    "EZ401",
    D152,
    "{block} would occupy {extent}, but there is nothing beyond {prefix}{last}: it may begin at "
    "{prefix}{latest} at the latest",
)
def block_beyond_bank(view: LoopView) -> Findings:
    """A block of registers or discretes reaches past the highest address.

    Why: a loop needs 32 consecutive registers and 8 consecutive discretes. What lies past the last address does not
    exist: the dialog refuses the base, and a writer of the image fails.

    Fix: let the block begin lower.
    """
    return shared_checks.block_beyond_bank(view, LAST_ADDRESSES)


@error("EZ402", BLOCK, "{block} {extent} of {loop} overlap {other_extent} of {other}")
def blocks_overlap(context: EzlogixContext) -> Findings:
    """Two loops share registers or discretes.

    Why: each loop reads its gains, limits and mode from its blocks, and writes its error and saturation there. Two
    loops in one block change each other's set points and modes. The registers that are reserved count as well.

    Fix: leave 32 registers and 8 discretes to every loop.
    """
    return shared_checks.blocks_overlap(context.loops)


@error("EZ403", COUNT, "{count} loops are listed; an EZLogix PLC calculates at most {limit}")
def too_many_loops(context: EzlogixContext) -> Findings:
    """The file has more loops than the PLC.

    Why: the dialog offers eight loops; nothing calculates a ninth one.

    Fix: move the loop to another PLC, and to a file of its own.
    """
    return shared_checks.too_many_loops(context.loops, MAX_LOOPS)


# --- Names of tags that the template makes ----------------------------------------------------------------------------

D182 = Decision(
    182,
    "what can be a tag",
    "A letter, then letters, digits and underscores; capital and small letters are one. Names that break this, or that "
    "two loops would share, are a warning: the tag list cannot be written, the loop itself works.",
    "The manual says what a tag's name tells, and not of which characters it may be.",
)


@warning("EZ411", D182, "{tag!r} is not usable as a tag: letters, digits and _ only, a letter first")
def name_not_usable_in_tags(context: EzlogixContext) -> Findings:
    """The name of a loop cannot stand in the names of its tags.

    Why: the template in `plc.tag_names` puts the loop's name into every tag. Names such as FIC-101 or `Oven 1` are
    common on drawings, but the tag list cannot be written with them.

    Fix: write the name with letters, digits and underscores, or use {loop} in place of {name} in the template.
    """
    variable = next(iter(VARIABLES.values()))
    for view in context.loops:
        tag = tag_name(context.config.plc.tag_names, view.index + 1, view.name, variable)
        if not TAG_NAME.fullmatch(tag):
            yield view.report("name", tag=tag)


@warning("EZ412", D182, "the tag {tag} of this loop is also one of loop {other}")
def tags_collide(context: EzlogixContext) -> Findings:
    """The template makes the same tag for two loops.

    Why: one name cannot stand for two registers, so the tag list cannot be written. Capital and small letters are not
    told apart: `Oven` and `OVEN` have all tags in common.

    Fix: rename one of the loops, or use {loop} in the template.
    """
    template = context.config.plc.tag_names
    owners: dict[str, dict[str, str]] = {}
    for view in context.loops:
        for variable in VARIABLES.values():
            tag = tag_name(template, view.index + 1, view.name, variable)
            owners.setdefault(tag.casefold(), {}).setdefault(view.name, tag)
    shared = [group for group in owners.values() if len(group) > 1]
    for view in context.loops:
        groups = [group for group in shared if view.name in group]
        pairs = {other: group[view.name] for group in reversed(groups) for other in group if other != view.name}
        for other, tag in pairs.items():
            yield view.report("name", tag=tag, other=other).with_other_loops(other)


# --- The tags of PV, CV and control output: what they share with each other and with the blocks -----------------------

PV_TAG = EZLOGIX.cite("Process Variable (PV) Tag")
CV_TAG = EZLOGIX.cite("Control Variable (CV) Tag")
OUTPUT_TAG = EZLOGIX.cite("Control Output Tag")
STOPPED_PLC = EZLOGIX.cite("Process PID when PLC is Stopped")
BASE = EZLOGIX.cite("Base Register Tag")

D180 = Decision(
    180,
    "a CV in another loop's set point register is a cascade",
    "A CV tag in any other register of a block is an error; in the set point register of another loop it is an info, "
    "and a warning when the CV's limits go beyond that set point's.",
    "Blocks hold what a loop runs by, and the manual lets any R register be a CV tag. Beyond the inner limits the set "
    "point stands still while the outer loop, whose CV is neither 0 nor 4095, goes on integrating.",
)
CV_TAG_TEXT = "CV tag"
NAMES_BY_OFFSET = {offset: name for name, offset in OFFSETS.items()}


@error("EZ404", BASE, "the {what} tag {tag} of {loop} is the register {register} of {owner}: {consequence}")
def tag_in_register_block(context: EzlogixContext) -> Findings:
    """A PV or CV tag is one of the 32 registers of a loop.

    Why: a CV that is written there replaces a gain, a limit or a set point at every calculation. A PV there is a
    parameter, not a measurement, and the ladder program that stores a measurement in it overwrites the parameter. The
    registers that are reserved count as well. The set point of another loop means a cascade, and is reported as such.

    Fix: choose a register outside all blocks.
    """
    for view in context.loops:
        for description, tag, side in (("PV", view.loop.pv.tag, "pv"), ("CV", view.loop.output.tag, "output")):
            owner = context.block_owner(tag)
            if owner is None or (description == "CV" and context.inner_loop(view) is not None):
                continue
            values = {
                "what": description,
                "tag": tag,
                "loop": view.name,
                "register": NAMES_BY_OFFSET[owner[1]],
                "owner": owner[0].name,
                "consequence": "the loop overwrites it" if description == "CV" else "it is no measurement",
            }
            if owner[0] is view:
                yield view.report(side, "tag").with_values(**values)
            else:
                at_owner = owner[0].report(owner[0].extents[0].key)
                yield from report_at_both(view, view.report(side, "tag"), owner[0], at_owner, **values)


@checklist(
    "EZ405",
    D180,
    "the CV tag {tag} of {loop} is the set point register of {inner}: a cascade; the CV's limits are {low} and {high} "
    "counts, the set point's {inner_low} and {inner_high}",
)
def cv_writes_set_point(context: EzlogixContext) -> Findings:
    """The CV of a loop is the set point of another one.

    Why: the registers are one, so what the file says of the inner set point is overwritten. The CV arrives in counts.
    Where it may go beyond the inner set point's limits (a warning), the set point stands still and the outer loop winds
    up, since a CV saturates at 0 and 4095 only.

    Fix: make the CV's limits those of the inner set point, if a cascade is meant. Otherwise choose a register outside
    all blocks.
    """
    for view in context.loops:
        inner = context.inner_loop(view)
        if inner is None:
            continue
        cv, sp = view.cv_limits, inner.setpoint_limits
        if cv is not None and sp is not None:
            beyond = cv[0] < sp[0] or cv[1] > sp[1]
            severity = Severity.WARNING if beyond else None
            names = {"loop": view.name, "tag": view.loop.output.tag, "inner": inner.name}
            limits = {"low": cv[0], "high": cv[1], "inner_low": sp[0], "inner_high": sp[1]}
            at_outer, at_inner = (
                view.report("output", "tag", severity=severity),
                inner.report("setpoint", severity=severity),
            )
            yield from report_at_both(view, at_outer, inner, at_inner, **names, **limits)


@error("EZ406", CV_TAG, "{tag} is also the {what} of {other}: two loops would write it")
def output_tag_shared(context: EzlogixContext) -> Findings:
    """Two loops have one CV tag, or one control output.

    Why: both write it, each at its own sample rate, and what the actuator sees is neither loop's output.

    Fix: give each loop outputs of its own. Where one actuator serves two loops, let the ladder program choose.
    """
    for (tag, (view, what)), (other_tag, (other, other_tags)) in permutations(_tags_written(context), 2):
        if tag == other_tag:
            place = ("output", "tag") if what == CV_TAG_TEXT else ("output", "pulse", "tag")
            basis = None if what == CV_TAG_TEXT else OUTPUT_TAG
            found = view.report(*place, basis=basis, tag=tag, what=other_tags, other=other.name)
            yield found if other is view else found.with_other_loops(other.name)


def _tags_written(context: EzlogixContext) -> Iterator[tuple[str, tuple[LoopView, str]]]:
    """The tags that loops write, with what they are."""
    for view in context.loops:
        output = view.loop.output
        yield output.tag, (view, CV_TAG_TEXT)
        if output.pulse is not None:
            yield output.pulse.tag, (view, "control output")


@per_loop
@error("EZ407", PV_TAG, "{tag} is PV tag and CV tag of the loop: it would measure its own output")
def pv_is_own_cv(view: LoopView) -> Findings:
    """A loop's PV tag is its CV tag.

    Why: what the loop writes is what it reads next. It controls its own register, and the process not at all.

    Fix: give the PV the register that holds the measurement.
    """
    if view.loop.pv.tag == view.loop.output.tag:
        yield view.report("output", "tag", tag=view.loop.output.tag)


def is_program_register(context: EzlogixContext, tag: str) -> bool:
    """Whether a tag is a register outside all blocks, which the ladder program fills or reads."""
    return register_number(tag) is not None and context.block_owner(tag) is None


@warning("EZ410", STOPPED_PLC, "the loop goes on while the PLC is stopped, but {tags}")
def logical_tag_while_stopped(context: EzlogixContext) -> Findings:
    """A loop is processed while the PLC is stopped, with tags that only the ladder program moves.

    Why: a stopped PLC executes no ladder. A PV in an R register stands still, and with any error left the integral runs
    the output to its end; a CV in an R register does not reach its actuator.

    Fix: use an IR tag for the PV, and an OR tag or the control output for the CV; or write
    `process_when_stopped: false` under `plc`.
    """
    if not context.config.plc.process_when_stopped:
        return
    outputs = {view.loop.output.tag for view in context.loops}
    for view in context.loops:
        pv, output = view.loop.pv.tag, view.loop.output
        is_frozen = is_program_register(context, pv) and pv not in outputs
        is_unread = is_program_register(context, output.tag) and output.pulse is None and output.tag != pv
        parts = [f"its PV {pv} stands still"] * is_frozen + [f"its CV {output.tag} reaches no output"] * is_unread
        if parts:
            yield view.report("pv" if is_frozen else "output", "tag", tags=" and ".join(parts))
