"""Build of the ament_python package advise_ros."""

from glob import glob

from setuptools import find_packages, setup

NODES = (
    'advise', 'console', 'expert', 'guard', 'logger', 'mavlink_bridge', 'pilot', 'policy', 'recorder',
    'simulator', 'teleop',
)
COMMANDS = (
    'answer', 'ask', 'demo', 'discretise', 'experiments', 'fly', 'fly_check', 'grid', 'recover', 'replay', 'route', 'site_map',
)

setup(
    name='advise_ros',
    version='0.1.0',
    packages=find_packages(include=['advise_ros', 'advise_ros.*']),
    package_data={'advise_ros': [
        'py.typed', 'middleware_loopback.xml', 'report/*.html', 'console/static/*', 'console/locale/*/*/*.po',
    ]},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/advise_ros']),
        ('share/advise_ros', ['package.xml']),
        ('share/advise_ros/config', glob('config/*.*')),
        ('share/advise_ros/config/sros2', glob('config/sros2/*.xml')),
        ('share/advise_ros/requirements', ['requirements/system-lock.txt']),
        ('share/advise_ros/launch', glob('launch/*.launch.py')),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='advise_ros maintainers',
    maintainer_email='maintainers@advise-ros.org',
    description='A drone learns a route from rough demonstrations and asks about what it is unsure of.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            *(f'{name} = advise_ros.front:nodes.{name}' for name in NODES),
            *(f'{name} = advise_ros.front:commands.{name}' for name in COMMANDS),
        ],
        'pytest11': ['advise_ros = advise_ros.replay.pytest_plugin'],
    },
)
