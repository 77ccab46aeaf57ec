"""Does our testing notice what is wrong? Planted bugs, mutants of the formulas, and a campaign over everything."""
