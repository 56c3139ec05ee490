"""How long frames took from stage to stage: computation, report, plots."""
