"""Build and install mobile_planning, with pip or with colcon."""
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'mobile_planning'


def configuration():
    """Return where each folder of ``config/`` goes, as setuptools wants its data files."""
    folders = {}
    for file in sorted(Path('config').rglob('*')):
        if file.is_file():
            folders.setdefault(file.parent, []).append(str(file))
    return [(f'share/{NAME}/{folder}', files) for folder, files in folders.items()]


setup(
    name=NAME,
    version='0.1.0',
    description='Motion planning for mobile robots on a shared map, with or without ROS',
    license='Apache-2.0',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    python_requires='>=3.10',
    install_requires=['setuptools', 'numpy', 'scipy', 'numba', 'osqp', 'PyYAML', 'Pillow', 'matplotlib', 'shapely'],
    zip_safe=False,
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *configuration(),
    ],
    entry_points={
        'console_scripts': [
            'map_server = mobile_planning.nodes.executables:map_server',
            'grid_planner = mobile_planning.nodes.executables:grid_planner',
            'sampling_planner = mobile_planning.nodes.executables:sampling_planner',
            'robot = mobile_planning.nodes.executables:robot',
            'world_sim = mobile_planning.nodes.executables:world_sim',
            'plan_path = mobile_planning.nodes.executables:plan_path',
            'simulate = mobile_planning.simulate:main',
        ],
    },
)
