"""Which law for a robot: the front of each law, a campaign of the candidates, a recommendation.

| module | |
|---|---|
| `search_space` | the gains of a law as a few factors on those of the start |
| `start` | gains from which a search begins |
| `stability` | small motions under a gain set along the whole mission |
| `trials` | flights of a gain set with a light and a heavy robot, and its score |
| `front` | the search for the least error at each ripple |
| `surrogate` | what trials would show, predicted for the search |
| `candidates` | one gain set a law, flown with many draws; who is out, and the ranks |
| `law_search` | the search of one law or several for a scenario |
| `recommend` | all of it for a scenario |
| `gain_files`, `report` | its gains, campaign, tables, JSON and page |
| `new_robot`, `robot_files` | the folder of a new robot, with the law chosen for it |
"""

from .law_search import ChoiceOptions, tune_law
from .recommend import Recommendation, recommend
from .trials import Uncertainty

__all__ = ["ChoiceOptions", "Recommendation", "Uncertainty", "recommend", "tune_law"]
