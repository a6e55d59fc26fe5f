"""What every test may count on: DDS kept on this machine, fresh kernels, the shared folder."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
import tempfile

from hypothesis import settings
import pytest

REPOSITORY = Path(__file__).resolve().parents[1]


def _kernel_cache() -> str:
    """Return a cache folder for compiled kernels that belongs to these sources.

    numba renews a cached function when its own file changes, not when one it calls does.
    """
    digest = hashlib.sha256()
    for source in sorted((REPOSITORY / 'ekf_fusion_ros').rglob('*.py')):
        text = source.read_bytes()
        if b'@kernel' in text:
            digest.update(text)
    return str(Path(tempfile.gettempdir()) / f'ekf_fusion_ros_numba_{digest.hexdigest()[:16]}')


def _domain() -> str:
    """Return a DDS domain of this process, for tests that run side by side."""
    first = int(os.environ.get('ROS_DOMAIN_ID', 1 + os.getpid() % 100))
    worker = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw'))
    return str(1 + (first - 1 + worker) % 100)


# Before rclpy or numba is imported by any test.
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ['ROS_DOMAIN_ID'] = _domain()
os.environ.setdefault('MPLBACKEND', 'Agg')
os.environ.setdefault('NUMBA_CACHE_DIR', _kernel_cache())

# No test asserts time: the first example of one may have to compile a kernel.
settings.register_profile('untimed', deadline=None)
settings.load_profile('untimed')


@pytest.fixture(scope='session')
def repository() -> Path:
    """Root of the repository."""
    return REPOSITORY


@pytest.fixture(scope='session')
def shared() -> Path:
    """Folder of recordings and references beside the repository; skips where it is absent."""
    folder = REPOSITORY.parent / 'shared'
    if not folder.is_dir():
        pytest.skip('no folder "shared" with recordings beside the repository')
    return folder
