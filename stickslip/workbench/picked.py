"""What is selected in the data, whether there is a model yet or not: a run and an event of it."""

from __future__ import annotations

from .session import Session


def chosen(session: Session) -> tuple[str, int]:
    """The run and the event that are shown."""
    campaign = session.campaign
    assert campaign is not None
    name = session.run if session.run in campaign.names else campaign.names[0]
    count = len(campaign.events[campaign.names.index(name)].events)
    event = session.event if session.run in campaign.names else count // 2
    return name, min(max(event, 0), max(count - 1, 0))


def select(session: Session, run: str, event: int) -> None:
    """Select an event of a run, or the nearest there is."""
    campaign = session.campaign
    if campaign is None or run not in campaign.names:
        return
    count = len(campaign.events[campaign.names.index(run)].events)
    session.param.update(run=run, event=min(max(event, 0), max(count - 1, 0)))
    session.later()
