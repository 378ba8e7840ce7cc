"""Which law for a robot: the front of each law, a campaign of the candidates, a recommendation.

| module | |
|---|---|
| `search_space` | the gains of a law as a few factors on a tuned set |
| `trials` | flights of a gain set with a light and a heavy robot, and its score |
| `front` | the search for the least error at each ripple |
| `candidates` | one gain set a law, flown with many draws; who is out, and the ranks |
| `choose` | all of it for a scenario |
| `files` | gains, campaign, JSON and the page of a choice |
"""

from .choose import Choice, ChoiceOptions, choose

__all__ = ["Choice", "ChoiceOptions", "choose"]
