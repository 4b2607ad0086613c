"""Errors of campaigns."""

from spherical_wrist.errors import WristError


class CampaignError(WristError):
    """The folder of a campaign cannot be used, or its episodes cannot be run to the end."""
