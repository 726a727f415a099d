"""The three numbers of a PID controller where they are parameters with names, as `pidcfg.encoders.tuned` has them."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.parameters import store
from pidcfg.frozen import frozen
from pidcfg.schemas.document import models_of
from pidcfg.schemas.limits import limits_at

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pidcfg.encoders.parameters import ParameterTable
    from pidcfg.encoders.tuned import GainUnit
    from pidcfg.schemas.limits import Limits


@frozen
class TunedParameters:
    """Parameters of gain, integral and derivative time, in the dependent form and in engineering units."""

    table: ParameterTable
    names: tuple[str, str, str]
    heating: str
    cooling: str
    gain_unit: GainUnit = "engineering"
    no_integral: Decimal = Decimal(0)
    dependent: tuple[str, bool] | None = None
    """The parameter that makes the other two times rather than gains, and its state then; None: they always are."""

    def key(self, name: str) -> str:
        """Where a parameter stands in the configuration: under its own name."""
        return self.table.row(name).name

    def unit(self, name: str) -> str:
        """The unit of a parameter; the gain's is that of the plant."""
        return "" if name == self.names[0] else "s"

    def stored(self, name: str, value: Decimal) -> Decimal:
        """What the parameter holds; raises `EncodeError`."""
        return Decimal(repr(store(self.table.row(name).type, value)))

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows for a parameter; raises `KeyError` for a name that no part of the model has."""
        key = name.partition(".")[0]
        part = next((part for part in models_of(model) if key in part.model_fields), None)
        if part is None:
            raise KeyError(name)
        return limits_at(part, name)

    def step(self, _: str) -> None:
        """Parameters are numbers in floating point."""
        return
