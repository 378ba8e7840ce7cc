"""Check that an untrusted study names only shipped files and modules."""

from __future__ import annotations

from space_robot_control.laws.trust import check_file, check_law

from ..store.software import texts_of
from ..study import Law, Study

CAMPAIGN = "campaign"


def check_study(study: Study) -> None:
    """Check that a study imports no module and opens no file but those that are shipped.

    Raises:
        NotTrustedError: it names one.
    """
    controller = study.scenario.get("parameters", {}).get("controller", {})
    named = [Law.parse(law).controller for law in study.laws]
    for name in (*named, *filter(None, [controller.get("controller")])):
        check_law(str(name), CAMPAIGN)
    laws = [Law.parse(law).gains for law in study.laws]
    for text in texts_of([laws, study.scenario, study.vary]):
        check_file("value of an option", text, CAMPAIGN)
