"""From an optimum to a machine that is built: lattices, tolerances, sensitivities, margins."""
