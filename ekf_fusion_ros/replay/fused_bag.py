"""Where the fused bag goes, and what of an earlier replay it may replace."""

from __future__ import annotations

from pathlib import Path

FOLDER = 'fused'
FILES = frozenset(('metadata.yaml', f'{FOLDER}.mcap'))


def check_place(output: Path, recording: Path) -> None:
    """Raise ValueError where the bag of `output` would replace what is no bag of a replay."""
    place = output / FOLDER
    if recording.resolve().is_relative_to(place.resolve()):
        raise ValueError(f'output {output}: its folder {FOLDER} holds the recording that is read: '
                         'choose another --output')
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise ValueError(f'output {output}: {place} is not a folder of an earlier replay: remove '
                         'it or choose another --output')
    foreign = _foreign(place) if place.exists() else []
    if foreign:
        raise ValueError(f'output {output}: {place} would be replaced but holds {foreign[0]}, '
                         'which is not of a replay: move it or choose another --output')


def make_room(output: Path) -> Path:
    """Remove the bag of an earlier replay; return where the new one goes."""
    place = output / FOLDER
    if place.exists():
        for name in FILES:
            (place / name).unlink(missing_ok=True)
        # Fails, as it should, where anything else has come meanwhile.
        place.rmdir()
    return place


def _foreign(place: Path) -> list[str]:
    return sorted(path.name for path in place.iterdir()
                  if path.name not in FILES or not path.is_file())
