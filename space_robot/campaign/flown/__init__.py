"""Campaigns: checked, flown to a table, stopped at a precision, their flights flown again."""

from .campaign import Campaign
from .flown_campaign import FlownCampaign

__all__ = ["Campaign", "FlownCampaign"]
