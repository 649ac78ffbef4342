"""What is said of designs: rows beside the paper's numbers, and a design in full."""
