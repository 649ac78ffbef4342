"""Training runs: recipes, folders, files, and what a run is trained and scored on."""
