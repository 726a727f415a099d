"""Pictures of runs: charts as data, drawn as SVG, PNG, a page or characters."""
