"""Motion from laws: the solver, scenario files, the rules that an effect's code must keep."""
