"""The figures of `curionav bench`, computed again from its journal: spreads, paired tests, the paper's order, claims.

``python -m curionav.report DIR`` prints them as JSON with the keys of ``summary.json``.
"""
