"""Transfer functions: lags, leads, integrators and dead time, the half rule, and how they are written as text."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from math import atan, isclose, pi, radians, sqrt
from typing import NoReturn

from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.tuning.rules import MAX_NUMBER, MIN_NUMBER, Process, TuningError, is_usable

# ----------------------------------------------------------------------------------------------------------------------
# Transfer functions of lags, leads, integrators and dead time, and the half rule that reduces them to a process.

D707 = Decision(
    707,
    "the half rule as published",
    "The largest time constants stay; half of the next one goes to the last that stays, its other half, all smaller "
    "ones and the times of negative zeros become dead time. A positive zero (T s + 1) is cancelled first against the "
    "next larger lag, or against the next smaller one where that is within a factor of 1.6 and nearer, by Skogestad's "
    "rules T1 to T3 with the dead time as closed-loop time constant.",
    "Skogestad, J. Process Control 13 (2003) 291, sections 2 and 4.",
)
D936 = Decision(
    936,
    "the dead time that the half rule's bounds are of is the one that it leads to",
    "Rules T1 to T3 ask how a lead compares with the dead time that is their result. Several may bear themselves out: "
    "the one that begins at the real dead time is taken, unless the phase of its process is more than 20 degrees off "
    "at 1/(2 L), where a loop of SIMC crosses over; then the one that begins at the dead time without the leads. Of a "
    "process that integrates and keeps no lag, the largest lag counts whole where there are leads, half where not.",
    "So all examples E1 to E15 come out as they are printed: E12 only from below, E6 only from above, and E6 with 1.69 "
    "of lags 1, 0.66 and 0.028 beside E8 with 1.5 of lags 1 and 1.",
)

NEAR_LAG_RATIO = 1.6
"""A smaller lag this near to a zero may cancel it."""
ROUNDING_TOLERANCE = 1e-9


@frozen
class Transfer:
    """Gain, the times T of factors (T s + 1) above and below the line, integrators, and dead time in s."""

    gain: float
    zeros: tuple[float, ...]
    poles: tuple[float, ...]
    integrators: int
    dead_time: float


def transfer_of(process: Process) -> Transfer:
    """A process with half its sample time as dead time."""
    lags = (process.second_time_constant,) if process.second_time_constant else ()
    if process.integrating:
        return Transfer(process.slope, (), lags, 1, process.delay)
    return Transfer(process.gain, (), (process.time_constant, *lags), 0, process.delay)


SLOW_LAG_FACTOR = 5
"""Times the closed-loop time constant: what is slower than that looks like an integrator."""
MAX_ROUNDS, DEAD_TIME_TOLERANCE = 30, 1e-12
"""The dead time is a result, and a bound of the rules that lead to it."""
MAX_PHASE_ERROR = radians(20)
"""By how much the phase of what the rules lead to may be off where a loop of its dead time crosses over (D936)."""


def reduce_by_half_rule(transfer: Transfer, order: int) -> Process:
    """The process of one or two lags that is nearest by the half rule; raises `TuningError` where none is."""
    least = _iterate_dead_time(transfer, order, transfer.dead_time)
    if all(zero < 0 for zero in transfer.zeros) or _is_near(least, transfer):
        return least
    return _iterate_dead_time(transfer, order, _halve_small_lags(replace(transfer, zeros=()), order).dead_time)


def _iterate_dead_time(transfer: Transfer, order: int, dead_time: float) -> Process:
    """The process whose own dead time bounds the rules that lead to it, from a first guess on."""
    for _ in range(MAX_ROUNDS):
        gain, lags = _cancel_leads(transfer, dead_time)
        process = _halve_small_lags(replace(transfer, gain=gain, poles=lags), order)
        if isclose(process.dead_time, dead_time, rel_tol=DEAD_TIME_TOLERANCE, abs_tol=DEAD_TIME_TOLERANCE):
            break
        dead_time = process.dead_time
    return process


def _is_near(process: Process, transfer: Transfer) -> bool:
    """Whether a process has about the phase of the transfer function where a loop of its dead time crosses over."""
    if not process.dead_time:
        return False
    reduced, w = transfer_of(process), 1 / (2 * process.dead_time)
    return abs(phase_at(reduced, w) - phase_at(transfer, w)) <= MAX_PHASE_ERROR


def phase_at(transfer: Transfer, w: float) -> float:
    """The phase at a frequency in rad/s, counted on from 0, of a positive gain."""
    leads, lags = sum(atan(w * zero) for zero in transfer.zeros), sum(atan(w * pole) for pole in transfer.poles)
    return leads - lags - transfer.integrators * pi / 2 - w * transfer.dead_time


def _halve_small_lags(transfer: Transfer, order: int) -> Process:
    """The largest lags, half of the next one, and the dead time that all others make."""
    count = order - transfer.integrators
    lags = sorted(transfer.poles, reverse=True)
    leads = any(zero > 0 for zero in transfer.zeros)
    # Nothing that stays takes the other half: with leads the whole counts, as E6 is printed, without them half, as E8.
    share = 1.0 if leads and not count else 0.5
    whole, part = lags[:count], sum(lags[count : count + 1])
    dead_time = (
        transfer.dead_time + part * share + sum(lags[count + 1 :]) - sum(zero for zero in transfer.zeros if zero < 0)
    )
    if whole:
        whole[-1] += part / 2
        whole.sort(reverse=True)
    if transfer.integrators:
        return Process(transfer.gain, 1.0, dead_time, second_time_constant=whole[0] if whole else 0.0, integrating=True)
    if not whole:
        raise TuningError("the transfer function has no lag: nothing that the rules take")
    return Process(transfer.gain, whole[0], dead_time, second_time_constant=whole[1] if len(whole) > 1 else 0.0)


def _cancel_leads(transfer: Transfer, dead_time: float) -> tuple[float, tuple[float, ...]]:
    """Gain and lags after each lead (a positive zero) has been cancelled against a lag near it."""
    gain, lags = transfer.gain, sorted(transfer.poles)
    for lead in sorted((zero for zero in transfer.zeros if zero > 0), reverse=True):
        if not lags:
            raise TuningError(f"no lag is left for the lead of {lead:g} s")
        lag = _lag_near(lead, lags)
        lags.remove(lag)
        if lead < lag and lead < SLOW_LAG_FACTOR * dead_time:  # T3
            bound = min(lag, SLOW_LAG_FACTOR * dead_time)
            gain *= bound / lag
            if bound > lead:
                lags = sorted([*lags, bound - lead])
        elif lead < lag or lag >= dead_time:  # T2, T1
            gain *= lead / lag
        elif lead >= dead_time:  # T1a
            gain *= lead / dead_time
    return gain, tuple(lags)


def _lag_near(lead: float, lags: list[float]) -> float:
    """The lag that a lead is cancelled against: the next larger one, or a smaller one that is nearer and close."""
    larger = next((lag for lag in lags if lag >= lead), None)
    smaller = next((lag for lag in reversed(lags) if lag < lead), None)
    if larger is None or smaller is None:
        return larger or smaller or lags[0]
    return smaller if lead / smaller < min(larger / lead, NEAR_LAG_RATIO) * (1 - ROUNDING_TOLERANCE) else larger


# --- A transfer function as text: ``(-0.3s+1)(0.08s+1)/((2s+1)(s+1)^2) exp(-1.5s)`` -----------------------------------
#
# Numbers, ``s``, brackets, powers, products with and without ``*``, one ``/`` or several, and ``exp(-1.5s)`` or
# ``e^(-1.5s)`` for the dead time. A product without a sign binds closer than ``/``. Polynomials in a bracket may be
# of second degree and must have real roots: the half rule needs time constants.

NUMBER_PATTERN = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
TOKEN_PATTERN = re.compile(
    rf"\s*(?:(?P<delay>(?:exp\s*|e\s*(?:\^|\*\*)\s*)[({{]?\s*-\s*(?P<dead>{NUMBER_PATTERN})?\s*\*?\s*s\s*[)}}]?)"
    rf"|(?P<number>{NUMBER_PATTERN})|(?P<sign>\*\*|[-+*/^()s]))"
)
MAX_CHARACTERS, MAX_POWER, MAX_FACTORS = 500, 20, 40
QUADRATIC_LENGTH = 3
"""Coefficients of a polynomial of second degree."""
Polynomial = tuple[float, ...]
"""Coefficients, the constant first."""


@dataclass
class Product:
    """Polynomials above and below the line, and the dead time."""

    numerator: list[Polynomial] = field(default_factory=list)
    denominator: list[Polynomial] = field(default_factory=list)
    dead_time: float = 0.0

    def multiply(self, other: Product, *, inverse: bool = False) -> Product:
        """The product with another one, or with its inverse."""
        above, below = (other.denominator, other.numerator) if inverse else (other.numerator, other.denominator)
        sign = -1 if inverse else 1
        return Product(self.numerator + above, self.denominator + below, self.dead_time + sign * other.dead_time)


def read_transfer(text: str) -> Transfer:
    """The transfer function; raises `TuningError` with the place of what cannot be read."""
    product = _Reader(text).read_all()
    gain, zeros, at_zero = _factorize(product.numerator)
    denominator, poles, integrators = _factorize(product.denominator)
    if not gain or not denominator:
        raise TuningError("the transfer function is 0, or divides by 0")
    if any(pole <= 0 for pole in poles):
        raise TuningError("the transfer function has an unstable pole: no rule is for such a process")
    order = integrators - at_zero
    if order < 0 or order > 1:
        raise TuningError("the transfer function may have one integrator (s below the line), and no s above it")
    if len(zeros) > len(poles) + order:
        raise TuningError("the transfer function has more zeros than poles")
    if product.dead_time < 0:
        raise TuningError("the dead time is negative; it is written exp(-1.5s), above the line")
    transfer = Transfer(gain / denominator, tuple(zeros), tuple(poles), order, product.dead_time)
    for number in (transfer.gain, *zeros, *poles, product.dead_time or MIN_NUMBER):
        if not is_usable(number):
            raise TuningError(
                f"the transfer function has {number:g}; its numbers go from {MIN_NUMBER:g} to {MAX_NUMBER:g}"
            )
    return transfer


class _Reader:
    """A reader of tokens, from left to right."""

    def __init__(self, text: str) -> None:
        if len(text) > MAX_CHARACTERS:
            raise TuningError(f"a transfer function of more than {MAX_CHARACTERS} characters")
        self.text, self.tokens, self.position = text, list[re.Match[str]](), 0
        place = 0
        while text[place:].strip():
            match = TOKEN_PATTERN.match(text, place)
            if match is None:
                place += len(text[place:]) - len(text[place:].lstrip())
                raise TuningError(f"the transfer function cannot be read at column {place + 1}: {text[place:][:20]!r}")
            self.tokens.append(match)
            place = match.end()

    def read_all(self) -> Product:
        """Everything that is there."""
        product = self.read_sum(0)
        if self.position < len(self.tokens):
            self.refuse_token()
        return product

    def refuse_token(self) -> NoReturn:
        """Raises `TuningError` at the token that does not fit."""
        if self.position == len(self.tokens):
            raise TuningError("the transfer function ends too early: a bracket or a factor is missing")
        token = self.tokens[self.position]
        column = token.end() - len(token.group().strip()) + 1
        raise TuningError(f"the transfer function cannot be read at column {column}: {self.text[column - 1 :][:20]!r}")

    def take_sign(self, *signs: str) -> str | None:
        """The next token, taken, if it is one of these signs."""
        if self.position < len(self.tokens) and self.tokens[self.position]["sign"] in signs:
            self.position += 1
            return self.tokens[self.position - 1]["sign"]
        return None

    def read_sum(self, depth: int) -> Product:
        """Terms with + and - between them; several become one polynomial."""
        if depth > MAX_POWER:
            raise TuningError("the transfer function has too many brackets in each other")
        negative = self.take_sign("+", "-") == "-"
        terms = [self.read_quotient(depth)]
        signs = [-1.0 if negative else 1.0]
        while sign := self.take_sign("+", "-"):
            signs.append(-1.0 if sign == "-" else 1.0)
            terms.append(self.read_quotient(depth))
        if len(terms) == 1:
            return terms[0].multiply(Product([(signs[0],)]))
        return Product([_add_polynomials([_multiply_out(term, sign) for term, sign in zip(terms, signs, strict=True)])])

    def read_quotient(self, depth: int) -> Product:
        """Factors with * and / between them."""
        product = self.read_factors(depth)
        while sign := self.take_sign("*", "/"):
            product = product.multiply(self.read_factors(depth), inverse=sign == "/")
        return product

    def read_factors(self, depth: int) -> Product:
        """Factors without a sign between them."""
        product = self.read_factor(depth)
        while self.position < len(self.tokens) and self.tokens[self.position]["sign"] in {None, "(", "s"}:
            product = product.multiply(self.read_factor(depth))
            if len(product.numerator) + len(product.denominator) > MAX_FACTORS:
                raise TuningError(f"a transfer function of more than {MAX_FACTORS} factors")
        return product

    def read_factor(self, depth: int) -> Product:
        """A number, s, a dead time or a bracket, with its power."""
        if self.position == len(self.tokens):
            self.refuse_token()
        token = self.tokens[self.position]
        if token["delay"]:
            self.position += 1
            return self.read_power(Product(dead_time=float(token["dead"] or 1)))
        if token["number"]:
            self.position += 1
            base = Product([(float(token["number"]),)])
        elif self.take_sign("s"):
            base = Product([(0.0, 1.0)])
        elif self.take_sign("("):
            base = self.read_sum(depth + 1)
            if not self.take_sign(")"):
                self.refuse_token()
        else:
            self.refuse_token()
        return self.read_power(base)

    def read_power(self, base: Product) -> Product:
        """A factor so many times."""
        if not self.take_sign("^", "**"):
            return base
        number = self.tokens[self.position]["number"] if self.position < len(self.tokens) else None
        if number is None or not number.isdigit() or not 0 < int(number) <= MAX_POWER:
            self.refuse_token()
        self.position += 1
        times = int(number)
        return Product(base.numerator * times, base.denominator * times, base.dead_time * times)


def _multiply_out(product: Product, sign: float) -> Polynomial:
    """A term of a sum, multiplied out; raises `TuningError` for a quotient or a dead time."""
    if product.denominator or product.dead_time:
        raise TuningError("a quotient or a dead time stands in a sum: write the transfer function as factors")
    result: Polynomial = (sign,)
    for factor in product.numerator:
        result = tuple(
            sum(result[i] * factor[k - i] for i in range(len(result)) if 0 <= k - i < len(factor))
            for k in range(len(result) + len(factor) - 1)
        )
        if len(result) > QUADRATIC_LENGTH:
            raise TuningError("a bracket of a higher degree than 2: write it as factors")
    return result


def _add_polynomials(polynomials: list[Polynomial]) -> Polynomial:
    size = max(map(len, polynomials))
    return tuple(sum(row[k] for row in polynomials if k < len(row)) for k in range(size))


def _factorize(polynomials: list[Polynomial]) -> tuple[float, list[float], int]:
    """The gain, the times T of factors (T s + 1), and how many factors are s alone."""
    gain, times, zero_roots = 1.0, list[float](), 0
    for polynomial in polynomials:
        rest = list(polynomial)
        while len(rest) > 1 and not rest[-1]:
            rest.pop()
        while len(rest) > 1 and not rest[0]:
            rest.pop(0)
            zero_roots += 1
        gain *= rest[0]
        if len(rest) == QUADRATIC_LENGTH:
            both, product = rest[1] / rest[0], rest[2] / rest[0]
            inner = both * both - 4 * product
            if inner < 0:
                raise TuningError("a factor swings by itself (complex roots): the half rule needs time constants")
            times += [(both + sqrt(inner)) / 2, (both - sqrt(inner)) / 2]
        elif len(rest) > 1:
            times.append(rest[1] / rest[0])
    return gain, times, zero_roots
