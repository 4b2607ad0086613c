"""How the laws of a campaign did, in a few figures each."""

from typing import Any

from spherical_wrist.campaign.store import Episodes

FIGURES = ("rms_error_rad", "max_tip_error_mm")
QUANTILES = (0.5, 0.95, 1.0)


def summary(episodes: Episodes) -> list[dict[str, Any]]:
    """One dictionary for each law: its episodes by outcome, and quantiles of the errors of those that completed."""
    outcomes = ", ".join(
        f"count(*) FILTER (outcome = '{outcome}') AS {outcome}"
        for outcome in ("completed", "diverged", "failed", "invalid")
    )
    figures = ", ".join(
        f"quantile_cont({name}, {list(QUANTILES)}) FILTER (outcome = 'completed') AS {name}" for name in FIGURES
    )
    asked = f"SELECT law, count(*) AS episodes, {outcomes}, {figures} FROM episodes GROUP BY law ORDER BY min(id)"
    return [
        {**row, **{name: dict(zip(map(str, QUANTILES), row[name] or [], strict=False)) for name in FIGURES}}
        for row in episodes.rows(asked)
    ]
