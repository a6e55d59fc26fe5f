"""Parameters: one declaration each, from which files, descriptors and documents are made."""

from ekf_fusion_ros.params.files import LoadedParams
from ekf_fusion_ros.params.files import load_file
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides

__all__ = ['LoadedParams', 'Params', 'load_file', 'with_overrides']
