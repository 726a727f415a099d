"""Loops as the rows of a sheet, CSV or XLSX, and sheets as configurations."""
