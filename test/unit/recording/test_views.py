"""The files for RViz and Foxglove have keys and values that those read; neither says a word of one that it does not know.

The tables were read in their sources: rviz 14.1.5 (Jazzy; github.com/ros2/rviz: plugins_description.xml, the displays' properties
in rviz_default_plugins/src/rviz_default_plugins/displays, qos_profile_property.cpp, visualization_manager.cpp,
fixed_orientation_ortho_view_controller.cpp) and foxglove-sdk 0.30.3 (PyPI; module foxglove.layouts: the panels' settings with
their allowed values). What a layout file looks like around the panels is nowhere published; Lichtblick (github.com/
Lichtblick-Suite/lichtblick) reads and writes the same. A tuple holds the allowed values, None allows any.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest
import yaml

from advise_ros.ros.topics import RECORDED
from support.paths import ROOT

Keys = dict[str, tuple[str, ...] | None]


def any_value(names: str) -> Keys:
    """Of names divided by commas."""
    return dict.fromkeys(names.split(', '))


def wrong(given: Mapping[str, Any], known: Keys) -> dict[str, Any]:
    """Entries that are not known, or have a value that is not."""
    return {
        key: value for key, value in given.items() if key not in known or ((allowed := known[key]) and value not in allowed)
    }


# -- RViz ------------------------------------------------------------------------------------
RVIZ = yaml.safe_load((ROOT / 'config' / 'advise.rviz').read_text())
MANAGER = RVIZ['Visualization Manager']
EVERY_DISPLAY = any_value('Class, Name, Enabled, Value')
LINE_STYLE: Keys = {'Line Style': ('Lines', 'Billboards')}
DISPLAYS: dict[str, Keys] = {
    'Grid': {
        **any_value('Reference Frame, Plane Cell Count, Normal Cell Count, Cell Size, Line Width, Color, Alpha, Offset'),
        **LINE_STYLE, 'Plane': ('XY', 'XZ', 'YZ'),
    },
    'Map': {
        **any_value('Topic, Update Topic, Alpha, Draw Behind, Use Timestamp, Binary representation, Binary threshold'),
        'Color Scheme': ('map', 'costmap', 'raw'),
    },
    'Path': {
        **any_value('Topic, Line Width, Color, Alpha, Buffer Length, Offset, Length, Radius, Pose Color'), **LINE_STYLE,
        'Pose Style': ('None', 'Axes', 'Arrows'),
    },
    'MarkerArray': any_value('Topic, Namespaces'),
    'Marker': any_value('Topic, Namespaces'),
    'Pose': {
        **any_value('Topic, Color, Alpha, Shaft Length, Shaft Radius, Head Length, Head Radius, Axes Length, Axes Radius'),
        'Shape': ('Arrow', 'Axes'),
    },
}
TOPIC: Keys = {
    **any_value('Value, Depth'), 'History Policy': ('System Default', 'Keep Last', 'Keep All'),
    'Reliability Policy': ('System Default', 'Reliable', 'Best Effort'),
    'Durability Policy': ('System Default', 'Transient Local', 'Volatile'),
}
TOOLS = (
    'MoveCamera', 'PublishPoint', 'Select', 'SetGoal', 'Measure', 'FocusCamera', 'SetInitialPose', 'Interact',
)


@pytest.mark.parametrize('display', MANAGER['Displays'], ids=lambda one: one['Name'])
def test_a_display_of_rviz_has_properties_that_it_knows(display: dict[str, Any]) -> None:
    plugins, kind = display['Class'].split('/')
    assert plugins == 'rviz_default_plugins'
    assert wrong(display, {**EVERY_DISPLAY, **DISPLAYS[kind]}) == {}
    assert wrong(display.get('Topic', {}), TOPIC) == {}
    assert isinstance(display['Enabled'], bool)


def test_the_rest_of_the_file_for_rviz_is_what_it_reads() -> None:
    assert wrong(RVIZ, any_value('Panels, Visualization Manager, Window Geometry')) == {}
    assert wrong(MANAGER, any_value('Class, Displays, Enabled, Global Options, Name, Tools, Transformation, Views')) == {}
    assert wrong(MANAGER['Global Options'], any_value('Fixed Frame, Background Color, Frame Rate')) == {}
    assert [one['Class'] for one in RVIZ['Panels']] == ['rviz_common/Displays']
    assert {one['Class'] for one in MANAGER['Tools']} <= {f'rviz_default_plugins/{name}' for name in TOOLS}
    view = MANAGER['Views']['Current']
    assert view['Class'] == 'rviz_default_plugins/TopDownOrtho'
    assert wrong(view, any_value('Class, Name, Scale, Angle, X, Y, Near Clip Distance, Target Frame, Value')) == {}


# -- Foxglove and Lichtblick -----------------------------------------------------------------
LAYOUT = json.loads((ROOT / 'config' / 'foxglove.json').read_text())
TITLE = any_value('foxglovePanelTitle, lichtblickPanelTitle')
PANELS: dict[str, Keys] = {
    '3D': {
        **any_value('scene, transforms, layers, topics, synchronize, cameraState, followTf, fixedFrame, publish'),
        'followMode': ('follow-none', 'follow-pose', 'follow-position', 'follow-heading'),
    },
    'RawMessages': {
        **any_value('diffEnabled, diffTopicPath, expansion, showFullMessageForDiff, topicPath, fontSize'),
        'diffMethod': ('custom', 'previous message'),
    },
    'CallService': {  # ServiceCall in the SDK, with the same settings.
        **any_value('serviceName, requestPayload, buttonText, buttonTooltip, buttonColor, editingMode, timeoutSeconds'),
        'layout': ('vertical', 'horizontal'),
    },
    'Plot': {
        **any_value(
            'paths, showLegend, showPlotValuesInLegend, showXAxisLabels, showYAxisLabels, isSynced, xAxisPath, minXValue, '
            'maxXValue, minYValue, maxYValue, followingViewWidth, sidebarDimension'),
        'legendDisplay': ('floating', 'left', 'top'), 'xAxisVal': ('timestamp', 'index', 'custom', 'currentCustom'),
    },
}
CAMERA = any_value(
    'distance, perspective, phi, target, targetOffset, targetOrientation, thetaOffset, fovy, near, far, logDepth')
SCENE = any_value('enableStats, backgroundColor, labelScaleFactor, ignoreColladaUpAxis, meshUpAxis, transforms, syncCamera')
GRID_LAYER: Keys = {
    **any_value('visible, instanceId, label, frameId, size, divisions, lineWidth, color, position, rotation'),
    'layerId': ('foxglove.Grid',),
}
SERIES: Keys = {
    **any_value('value, enabled, label, color, showLine, lineSize'),
    'timestampMethod': ('receiveTime', 'headerStamp', 'publishTime'),
}
# What the 3D panel takes for a topic of each type.
SHOWN: dict[str, Keys] = {
    'nav_msgs/msg/OccupancyGrid': {
        **any_value('visible, minColor, maxColor, unknownColor, invalidColor, drawBehind, alpha, frameLocked'),
        'colorMode': ('custom', 'costmap', 'map', 'raw'),
    },
    'nav_msgs/msg/Path': {
        **any_value('visible, axisScale, arrowScale, lineWidth, gradient'), 'type': ('axis', 'arrow', 'line'),
    },
    'geometry_msgs/msg/PoseStamped': {
        **any_value('visible, axisScale, arrowScale, color, showCovariance, covarianceColor'), 'type': ('axis', 'arrow'),
    },
    'nav_msgs/msg/Odometry': {
        **any_value('visible, axisScale, arrowScale, color, showCovariance, covarianceColor'), 'type': ('axis', 'arrow'),
    },
    'visualization_msgs/msg/Marker': any_value('visible, color, showOutlines, selectedIdVariable, namespaces'),
    'visualization_msgs/msg/MarkerArray': any_value('visible, color, showOutlines, selectedIdVariable, namespaces'),
}


@pytest.mark.parametrize('name', LAYOUT['configById'])
def test_a_panel_of_the_layout_has_settings_that_it_knows(name: str) -> None:
    panel = LAYOUT['configById'][name]
    assert wrong(panel, {**PANELS[name.partition('!')[0]], **TITLE}) == {}
    for series in panel.get('paths', []):
        assert wrong(series, SERIES) == {}


def test_the_three_dimensional_panel_shows_each_topic_by_settings_of_its_type() -> None:
    panel = LAYOUT['configById']['3D!advise']
    assert wrong(panel['cameraState'], CAMERA) == wrong(panel['scene'], SCENE) == {}
    for layer in panel['layers'].values():
        assert wrong(layer, GRID_LAYER) == {}
    for topic, settings in panel['topics'].items():
        assert wrong(settings, SHOWN[RECORDED[topic.lstrip('/')][0]]) == {}, topic


def test_the_layout_is_a_tree_of_two_sided_splits() -> None:
    assert wrong(LAYOUT, any_value('configById, globalVariables, userNodes, playbackConfig, layout')) == {}
    left: list[Any] = [LAYOUT['layout']]
    while left:
        node = left.pop()
        if isinstance(node, str):
            assert node in LAYOUT['configById']
            continue
        assert wrong(node, {**any_value('first, second, splitPercentage'), 'direction': ('row', 'column')}) == {}
        left += [node['first'], node['second']]


def test_what_is_misspelt_is_found() -> None:
    assert wrong({'Colour': 1, 'Shape': 'Round', 'Alpha': 1}, DISPLAYS['Pose']) == {'Colour': 1, 'Shape': 'Round'}
