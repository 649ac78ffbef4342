"""The verbs of ``pkm-gym`` that agents bring, a file each."""
