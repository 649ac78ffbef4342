"""The verbs of ``pkm-gym``, a file each."""
