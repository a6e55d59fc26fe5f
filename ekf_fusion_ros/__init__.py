"""PX4's EKF2 in Python: odometry and GPS in, a fused track out.

The public names are imported when first asked for; numpy alone is enough for all of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING
from typing import Any

if TYPE_CHECKING:
    from ekf_fusion_ros.ekf2.ekf2 import Ekf2
    from ekf_fusion_ros.estimator import AidStatus
    from ekf_fusion_ros.estimator import Estimator
    from ekf_fusion_ros.estimator import Event
    from ekf_fusion_ros.estimator import GeoPoint
    from ekf_fusion_ros.estimator import GivenPose
    from ekf_fusion_ros.estimator import Health
    from ekf_fusion_ros.estimator import NavState
    from ekf_fusion_ros.lpe.lpe import Lpe
    from ekf_fusion_ros.params.ekf2 import Ekf2Params
    from ekf_fusion_ros.params.files import load_file
    from ekf_fusion_ros.params.lpe import LpeParams
    from ekf_fusion_ros.params.tree import Params
    from ekf_fusion_ros.params.tree import with_overrides
    from ekf_fusion_ros.samples import AirspeedSample
    from ekf_fusion_ros.samples import AuxVelocitySample
    from ekf_fusion_ros.samples import BaroSample
    from ekf_fusion_ros.samples import DriftSample
    from ekf_fusion_ros.samples import FlowSample
    from ekf_fusion_ros.samples import GnssSample
    from ekf_fusion_ros.samples import HeadingSample
    from ekf_fusion_ros.samples import ImuSample
    from ekf_fusion_ros.samples import LandedSample
    from ekf_fusion_ros.samples import MagSample
    from ekf_fusion_ros.samples import RangeSample
    from ekf_fusion_ros.samples import VelocityFrame
    from ekf_fusion_ros.samples import VisionSample
    from ekf_fusion_ros.session import FusionSession

__version__ = '0.1.0'

_HOMES = {
    'ekf2.ekf2': ('Ekf2',),
    'lpe.lpe': ('Lpe',),
    'estimator': (
        'AidStatus', 'Estimator', 'Event', 'GeoPoint', 'GivenPose', 'Health', 'NavState'),
    'params.ekf2': ('Ekf2Params',),
    'params.lpe': ('LpeParams',),
    'params.files': ('load_file',),
    'params.tree': ('Params', 'with_overrides'),
    'samples': (
        'AirspeedSample',
        'AuxVelocitySample',
        'BaroSample',
        'DriftSample',
        'FlowSample',
        'GnssSample',
        'HeadingSample',
        'ImuSample',
        'LandedSample',
        'MagSample',
        'RangeSample',
        'VelocityFrame',
        'VisionSample',
    ),
    'session': ('FusionSession',),
}
_MODULE_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    'AidStatus',
    'AirspeedSample',
    'AuxVelocitySample',
    'BaroSample',
    'DriftSample',
    'Ekf2',
    'Ekf2Params',
    'Estimator',
    'Event',
    'FlowSample',
    'FusionSession',
    'GeoPoint',
    'GivenPose',
    'GnssSample',
    'HeadingSample',
    'Health',
    'ImuSample',
    'LandedSample',
    'Lpe',
    'LpeParams',
    'MagSample',
    'NavState',
    'Params',
    'RangeSample',
    'VelocityFrame',
    'VisionSample',
    'load_file',
    'with_overrides',
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use."""
    if name not in _MODULE_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_MODULE_OF[name]}'), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *__all__})
