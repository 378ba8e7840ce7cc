"""Execution of campaigns: checks, flights, tables, stopping rule, reruns of single flights."""

from .campaign import Campaign
from .flown_campaign import FlownCampaign

__all__ = ["Campaign", "FlownCampaign"]
