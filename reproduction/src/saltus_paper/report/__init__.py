"""The report: one HTML file from templates, with pictures, claims, errata and where each number
comes from.
"""
