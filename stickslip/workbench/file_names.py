"""Names that a browser gives to files and folders: one plain name in the campaign's folder, or an error."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..objects.campaign import Campaign

LONGEST = 120
FORBIDDEN = '/\\:*?"<>|'
RESERVED = {"con", "prn", "aux", "nul", *(f"{n}{i}" for n in ("com", "lpt") for i in range(1, 10))}  # of Windows
ALLOWED = "one plain name, such as run6.csv: no folders, no leading point"


def new_place(folder: Path, name: str, key: str = "name") -> Path:
    """Where something new of that name goes in a folder.

    Args:
        folder: in which it goes.
        name: as it was asked for.
        key: what an error calls it.

    Raises:
        InputError: it is not one plain name, or there is something of that name already.
    """
    text = name.strip()
    plain = (
        bool(text)
        and len(text) <= LONGEST
        and text.isprintable()
        and not any(c in FORBIDDEN for c in text)
        and text[0] not in ".-"
        and text[-1] != "."
        and text.split(".")[0].lower() not in RESERVED
    )
    if not plain:
        raise InputError("the name cannot be used", key=key, value=name[: 2 * LONGEST], allowed=ALLOWED)
    path = folder / text
    taken = any(p.name.casefold() == text.casefold() for p in folder.iterdir())
    if taken or path.is_symlink() or path.resolve().parent != folder.resolve():
        raise InputError("there is something of that name already", key=key, value=name, hint="choose another name")
    return path


def new_folder(campaign: Campaign, name: str, key: str) -> Path:
    """The same in the folder of a campaign.

    Raises:
        InputError: as of :func:`new_place`, or the campaign is of no file.
    """
    if not campaign.description.filed:
        raise InputError("this campaign has no folder", hint="only a campaign of a file has one")
    return new_place(campaign.description.folder, name, key)
