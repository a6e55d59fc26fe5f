"""Read the EKF2 parameters that a PX4 log was flown with."""

from __future__ import annotations

from pathlib import Path

from ekf_fusion_ros.params.px4 import concerns_filter

MAGIC = b'ULog'


def read_ulog(path: Path) -> tuple[dict[str, float], list[str]]:
    """Return {EKF2 name or MAV_TYPE: first value} of a ULog and what else it says, in words.

    Raises ValueError naming the file: no ULog, or the library pyulog is missing.
    """
    try:
        from pyulog import ULog
    except ModuleNotFoundError:
        raise ValueError(
            f'{path}: reading a ULog needs the library pyulog: pip install pyulog') from None
    with path.open('rb') as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ValueError(f'{path}: not a ULog file')
    try:
        # An empty list of topics: only what stands beside the data is kept.
        log = ULog(str(path), message_name_filter_list=[])
    except Exception as error:  # damaged bytes can make the library raise anything
        raise ValueError(f'{path}: not a ULog file that can be read ({error})') from None
    values = {name: float(value) for name, value in log.initial_parameters.items()
              if concerns_filter(name)}
    others = len(log.initial_parameters) - len(values)
    remarks = [f'{others} parameters of other PX4 modules'] if others else []
    changed = {name for _, name, value in log.changed_parameters
               if name in values and value != log.initial_parameters[name]}
    remarks += [f'{name} as it was changed during the log' for name in sorted(changed)]
    return values, remarks
