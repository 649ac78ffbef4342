"""All ways to a design side by side, and the whole study in one go."""
