"""Summary of a campaign: a few figures for each law."""

from typing import Any

from spherical_wrist.campaign.store import Episodes

FIGURES = ("rms_error_rad", "max_tip_error_mm")
QUANTILES = (0.5, 0.95, 1.0)


def summary(episodes: Episodes) -> list[dict[str, Any]]:
    """Return a dictionary for each law: episodes by outcome, and quantiles of the errors of completed episodes."""
    outcomes = ", ".join(
        f"count(*) FILTER (outcome = '{outcome}') AS {outcome}"
        for outcome in ("completed", "diverged", "failed", "invalid")
    )
    figures = ", ".join(
        f"quantile_cont({name}, {list(QUANTILES)}) FILTER (outcome = 'completed') AS {name}" for name in FIGURES
    )
    query = f"SELECT law, count(*) AS episodes, {outcomes}, {figures} FROM episodes GROUP BY law ORDER BY min(id)"
    return [
        {**row, **{name: dict(zip(map(str, QUANTILES), row[name] or [], strict=False)) for name in FIGURES}}
        for row in episodes.rows(query)
    ]
