"""Installs the package: with colcon for `ros2 run`, with pip as a library and its commands."""

from glob import glob

from setuptools import find_packages
from setuptools import setup

package_name = 'ekf_fusion_ros'

extras = {
    # Never in install_requires: a ROS 2 installation brings its own rclpy.
    'ros': [
        'ros-jazzy-rclpy',
        'ros-jazzy-common-interfaces',
        'ros-jazzy-rmw-fastrtps-cpp',
    ],
    'replay': [
        'rosbags>=0.11',
        'tqdm',
        'lz4',
        'backports.zstd; python_version < "3.14"',
    ],
    # numba compiles numpy's linear algebra against the BLAS that scipy carries.
    'fast': ['numba>=0.59', 'scipy'],
    'plot': ['matplotlib'],
    'geo': ['pygeomag'],
    'ulog': ['pyulog'],
    'test': [
        'pytest', 'pytest-xdist', 'hypothesis', 'scipy', 'pyproj', 'pymap3d', 'pygeomag',
        'pyulog',
    ],
    'dev': [
        'colcon-common-extensions',
        'mypy>=1.15',
        'pre-commit',
        'ruff>=0.17,<0.18',
        'types-PyYAML',
    ],
}

setup(
    name=package_name,
    version='0.1.0',
    description="PX4's EKF2 for ROS 2: odometry and GPS in, a fused track out",
    long_description=open('README.md', encoding='utf-8').read(),
    long_description_content_type='text/markdown',
    author='ekf_fusion_ros contributors',
    maintainer='ekf_fusion_ros contributors',
    maintainer_email='maintainers@ekf-fusion-ros.example',
    license='BSD-3-Clause',
    python_requires='>=3.10',
    packages=find_packages(include=[package_name, f'{package_name}.*']),
    package_data={package_name: ['geo/*.csv']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', sorted(glob('config/*.*'))),
        (f'share/{package_name}/launch', sorted(glob('launch/*.launch.py'))),
    ],
    install_requires=['numpy>=1.26', 'PyYAML'],
    extras_require=extras,
    zip_safe=False,
    entry_points={
        'console_scripts': [
            f'fuser = {package_name}.__main__:fuser',
            f'replay = {package_name}.__main__:replay',
            f'report = {package_name}.__main__:report',
            f'simulate = {package_name}.__main__:simulate',
        ],
    },
)
