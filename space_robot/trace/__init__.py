"""Requirements traced to evidence: flights, campaigns, tests, analyses, inspections."""
