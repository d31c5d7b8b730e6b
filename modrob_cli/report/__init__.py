"""Reports: one self-contained HTML file that a person can read, print and sign."""
