"""What the verbs share: options, what they mean, and how results are printed."""
