"""The learnt route onto a simulated vehicle: a real bag, real processes, real MAVLink over UDP."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from advise_ros.commands import route
from advise_ros.config import AdviseConfig
from advise_ros.core.learning.session import Session
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.settings import learn_settings
from support.graph import Graph
from support.session_bag import GRID, SessionBag


def learnt_session() -> SessionBag:
    """One flight, and the policy learnt of it."""
    bag = SessionBag(advise=AdviseConfig(acquisition='site'))
    session = Session(GRID, learn_settings(bag.advise))
    session.add(bag.demonstrate(()))
    bag.learn(session)
    return bag


def grid_file(path: Path, **other: object) -> Path:
    path.write_text(yaml.safe_dump({'grid': {**grid_to_mapping(GRID), 'origin_wgs84': [47.3977, 8.5456], **other}}))
    return path


@pytest.mark.parametrize('autopilot', ['ardupilot', 'px4'])
def test_the_route_of_a_bag_is_on_the_vehicle(
    graph: Graph, tmp_path: Path, free_udp_port: int, autopilot: str, capsys: pytest.CaptureFixture[str],
) -> None:
    bag, grid = learnt_session().write(tmp_path / 'bag'), grid_file(tmp_path / 'grid.yaml')
    simulator = graph.start('simulator', params={'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'autopilot': autopilot})
    done = route.run(['upload', str(bag), '--grid', str(grid), '--to', f'udpin:127.0.0.1:{free_udp_port}'])
    said = capsys.readouterr()
    assert done == 0, said.err
    assert f'vehicle 1 ({autopilot}) has the route: take-off and ' in said.out and 'read back and compared' in said.out
    assert simulator.terminate() == 0


def test_no_vehicle_a_grid_without_a_place_and_another_grid_are_refused(
    tmp_path: Path, free_udp_port: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr('advise_ros.missions.upload.WAIT_S', 0.5)
    bag = str(learnt_session().write(tmp_path / 'bag'))
    to = ['--to', f'udpin:127.0.0.1:{free_udp_port}']
    (tmp_path / 'bare.yaml').write_text(yaml.safe_dump({'grid': grid_to_mapping(GRID)}))
    cases = (
        (grid_file(tmp_path / 'grid.yaml'), 'no autopilot answers'), (tmp_path / 'bare.yaml', 'add origin_wgs84'),
        (grid_file(tmp_path / 'high.yaml', altitude=9.0), 'of another grid (altitude_m: 3.0)'),
    )
    for grid, expected in cases:
        assert route.run(['upload', bag, '--grid', str(grid), *to]) == 2
        assert expected in capsys.readouterr().err


def test_export_writes_what_its_name_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, grid = str(learnt_session().write(tmp_path / 'bag')), str(grid_file(tmp_path / 'grid.yaml'))
    for ending in ('plan', 'waypoints', 'kml', 'geojson'):
        out = tmp_path / f'route.{ending}'
        assert route.run(['export', bag, '--grid', grid, '--out', str(out)]) == 0
        assert out.stat().st_size > 100 and str(out) in capsys.readouterr().out
