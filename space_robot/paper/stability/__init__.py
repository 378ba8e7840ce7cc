"""The paper's stability analysis (Section III-C, Appendices A and B) of a law in flight.

| module | content |
|---|---|
| `lemma_1` | norm and radius of ``W = E - H_S^-1 h_bar`` (69) |
| `time_delay_error` | eps (65) and the bound beta of its derivative |
| `circle_criterion` | G(s) and its peak (72)-(77) |
| `lyapunov` | the LMI (51), M and gamma, the reaching time (56) |
| `reaching` | a flight from an initial error |
| `super_twisting` | the conditions on K_1 and K_2 |
| `study` | the flights of a study, and all of the above |
| `report`, `display` | the study as JSON and as tables |
"""

from .report import report
from .study import StabilityStudy, study

__all__ = ["StabilityStudy", "report", "study"]
