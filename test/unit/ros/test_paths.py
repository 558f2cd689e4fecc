"""Routes as nav_msgs/Path, the grid as a map, poses as transforms."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped

from advise_ros.core.errors import InputError
from advise_ros.recording.place import Place
from advise_ros.ros import convert
from advise_ros.ros.geo_route import GeoRouteTopic
from advise_ros.ros.maps import obstacle_map
from advise_ros.ros.paths import demonstrated_path, learnt_path, stamp
from advise_ros.ros.transform import TransformTopic
from support.learning import CORRIDOR, EAST, ROUND_TRIP, demonstration, ready


def places(path: Any) -> list[tuple[float, float, float]]:
    return [(one.pose.position.x, one.pose.position.y, one.pose.position.z) for one in path.poses]


def test_a_demonstration_is_a_path_of_cell_centres_with_its_stamps() -> None:
    flown = demonstration(CORRIDOR, [(0, EAST), (1, EAST), (2, EAST)])
    path = demonstrated_path(flown)
    assert places(path) == [(0.5, 0.5, 2.0), (1.5, 0.5, 2.0), (2.5, 0.5, 2.0), (3.5, 0.5, 2.0)]
    stamps = [convert.stamp_to_ns(one.header.stamp) for one in path.poses]
    assert stamps == [*flown.stamps_ns, flown.stamps_ns[-1]]
    assert {one.header.frame_id for one in path.poses} == {path.header.frame_id} == {'map'}


def test_a_demonstration_that_takes_one_back_is_an_empty_path() -> None:
    assert not demonstrated_path(demonstration(CORRIDOR, [])).poses


def test_the_learnt_route_begins_at_the_start_and_has_one_stamp() -> None:
    learned = ready().learned
    assert learned is not None
    path = learnt_path(learned)
    stamp(path, 5)
    assert places(path)[0][:2] == ROUND_TRIP.centre_enu_m(ROUND_TRIP.cell_of(ROUND_TRIP.start_state()))
    assert {convert.stamp_to_ns(one.header.stamp) for one in (path, *path.poses)} == {5}


def test_the_grid_is_a_map_of_its_blocked_cells() -> None:
    grid = replace(CORRIDOR, blocked=(1,))
    assert list(obstacle_map(grid, 0).data) == [0, 100, 0, 0]


def test_transforms_take_a_package_that_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', None)
    with pytest.raises(InputError, match="tf_child_frame' is 'base_link' and the package tf2_msgs is not installed"):
        TransformTopic(SimpleNamespace(), 'base_link')  # type: ignore[arg-type]


def test_a_pose_is_the_transform_to_the_vehicle(monkeypatch: pytest.MonkeyPatch) -> None:
    """With mocks of tf2_msgs and of the node: the package is not among what is installed without ROS."""
    sent: list[Any] = []
    module = ModuleType('tf2_msgs.msg')
    module.TFMessage = lambda transforms: transforms  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'tf2_msgs', ModuleType('tf2_msgs'))
    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', module)
    node: Any = SimpleNamespace(create_publisher=lambda kind, topic, profile: SimpleNamespace(publish=sent.extend))
    pose = PoseStamped()
    pose.header.frame_id, pose.pose.position.y, pose.pose.orientation.z = 'map', 2.0, 1.0
    TransformTopic(node, '').publish(pose)
    assert not sent
    TransformTopic(node, 'base_link').publish(pose)
    (transform,) = sent
    assert (transform.header.frame_id, transform.child_frame_id) == ('map', 'base_link')
    assert (transform.transform.translation.y, transform.transform.rotation.z) == (2.0, 1.0)


def of_geographic_msgs(**fields: Any) -> SimpleNamespace:
    return SimpleNamespace(**fields, poses=[], pose=SimpleNamespace(position=SimpleNamespace()))


def test_the_learnt_route_lies_on_the_earth_where_its_grid_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """With mocks of geographic_msgs and of the node: the package is not among what is installed without ROS."""
    sent: list[Any] = []
    module = ModuleType('geographic_msgs')
    module.msg = SimpleNamespace(GeoPath=of_geographic_msgs, GeoPoseStamped=of_geographic_msgs)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'geographic_msgs', module)
    node: Any = SimpleNamespace(create_publisher=lambda kind, topic, profile: SimpleNamespace(publish=sent.append))
    learned = ready().learned
    assert learned is not None
    route = learnt_path(learned)
    GeoRouteTopic(node, None).publish(route)
    assert not sent, 'a grid without a place'
    place = Place(47.0, 8.0, 90.0)
    GeoRouteTopic(node, place.on_earth).publish(route)
    (path,) = sent
    back = place.positions(*(
        np.array([getattr(one.pose.position, name) for one in path.poses]) for name in ('latitude', 'longitude', 'altitude')
    ))
    assert [tuple(one[:2]) for one in back] == [pytest.approx(one[:2], abs=1e-6) for one in places(route)]
    assert all(math.isnan(one.pose.position.altitude) for one in path.poses)
    assert path.header is route.header


def test_a_route_on_the_earth_says_which_package_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'geographic_msgs', None)
    lines: list[str] = []
    node: Any = SimpleNamespace(get_logger=lambda: SimpleNamespace(info=lines.append))
    GeoRouteTopic(node, Place(47.0, 8.0).on_earth).publish(learnt_path(ready().learned))
    assert 'ros-jazzy-geographic-msgs' in lines[0]
