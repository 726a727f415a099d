"""The EZLogix adapter of conversions."""

from pidcfg.convert.ezlogix_from import CONVERT_OPTIONS, from_neutral
from pidcfg.convert.ezlogix_to import NOTHING_LOST, to_neutral

__all__ = ["CONVERT_OPTIONS", "NOTHING_LOST", "from_neutral", "to_neutral"]
