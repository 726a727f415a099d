"""The commissioning report: loop sheets, findings and runs as one HTML page, as CSV files and as a workbook."""
