"""What can go wrong with a campaign as a whole."""

from spherical_wrist.errors import WristError


class CampaignError(WristError):
    """A campaign's directory cannot be used, or its episodes cannot be run to the end."""
