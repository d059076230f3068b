"""What `curionav bench` found: spreads, paired tests, the paper's order, claims, and the report for people.

``python -m curionav.report DIR`` writes report.html and summary.json beside the results; it needs the extra `report`.
"""
