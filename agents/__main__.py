"""``python -m agents VERB`` in the checkout: the same verbs as ``pkm-gym VERB``."""

from pkm_gym.__main__ import main

if __name__ == "__main__":
    main()
