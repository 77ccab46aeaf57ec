"""Does our testing notice what is wrong? Planted bugs that shipped checks must catch, and mutants of the formulas."""
