"""Reports of campaigns: figures with confidence intervals, as a self-contained page."""
