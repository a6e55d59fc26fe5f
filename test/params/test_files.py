"""Parameter files of the three kinds, read against values written by hand."""

from __future__ import annotations

from pathlib import Path
import re

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params import with_overrides


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding='utf-8')
    return path


def test_yaml_nested_and_dotted_names_mean_the_same(tmp_path: Path) -> None:
    nested = written(tmp_path, 'nested.yaml', """
/**:
  ros__parameters:
    ekf2:
      gnss: {pos_noise: 0.8, checks: {req_nsats: 9}}
      imu:
        position: [0.1, 0.2, 0.3]
""")
    dotted = written(tmp_path, 'dotted.yaml', """
fuser:
  ros__parameters:
    use_sim_time: true
    qos_overrides./odom.subscription.depth: 5
    ekf2.gnss.pos_noise: 8e-1
    ekf2.gnss.checks.req_nsats: 9
    ekf2.imu: {position: [0.1, 0.2, 0.3]}
""")
    expected = with_overrides(Params(), {
        'ekf2.gnss.pos_noise': 0.8,
        'ekf2.gnss.checks.req_nsats': 9,
        'ekf2.imu.position': (0.1, 0.2, 0.3),
    })

    assert load_file(nested).params == expected
    assert load_file(dotted).params == expected
    assert load_file(dotted).unused == []


def test_yaml_sections_of_other_nodes_are_listed_not_used(tmp_path: Path) -> None:
    path = written(tmp_path, 'two.yaml', """
/robot1/fuser:
  ros__parameters: {ekf2: {gnss: {pos_noise: 0.7}}}
/robot1:
  camera:
    ros__parameters: {exposure: 3}
""")
    loaded = load_file(path)

    assert loaded.params.ekf2.gnss.pos_noise == 0.7
    assert loaded.unused == ['/robot1/camera (section of another node)']


def test_files_stack(tmp_path: Path) -> None:
    first = written(tmp_path, 'a.yaml', '/**: {ros__parameters: {ekf2.gnss.pos_noise: 0.7}}')
    second = written(tmp_path, 'b.yaml', '/**: {ros__parameters: {ekf2.gnss.vel_noise: 0.9}}')
    params = load_file(second, load_file(first).params).params

    assert (params.ekf2.gnss.pos_noise, params.ekf2.gnss.vel_noise) == (0.7, 0.9)


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('a.yaml', '/**: {ros__parameters: {ekf2.gnss.pos_noize: 1.0}}', 'did you mean'),
        ('a.yaml', '/**: {ros__parameters: {ekf2.gnss.pos_noise: 1000.0}}', 'at most'),
        ('a.yaml', '/**: {ros__parameters: [1, 2]}', 'name: value'),
        ('a.yaml', 'ekf2: {gnss: {pos_noise: 1.0}}', 'no ros__parameters'),
        ('a.yaml', '', 'no ros__parameters'),
        ('a.yaml', '/**: [unclosed', 'not a YAML file'),
        ('a.yaml', '/**:\n  ros__parameters:\n    estimator: ekf2\n    estimator: lpe\n',
         'estimator twice in line 4'),
        ('a.params', '1 1 EKF2_GPS_DELAY 110\n', 'line 1: expected "vehicle component'),
        ('a.params', '1 1 EKF2_GPS_DELAY fast 9\n', "line 1: 'fast' is not a number"),
        ('a.params', '1 1 EKF2_GPS_P_NOISE 1000 9\n', 'at most'),
        ('a.params', '1 1 EKF2_HGT_MODE 7 6\n', 'EKF2_HGT_MODE = 7.0: choose one of'),
        ('a.params', '1 1 EKF2_AID_MASK -1 6\n', 'not negative'),
        ('a.params', '', 'holds no parameter of EKF2 or LPE'),
        ('a.params', '1 1 MC_ROLL_P 6.5 9\n1 1 MC_YAW_P 2.8 9\n',
         'holds no parameter of EKF2 or LPE; 2 parameters of other PX4 modules'),
        ('a.txt', 'gps_delay_ms 110\n', 'line 1: expected name=value'),
        ('a.txt', 'imu_pos_body=1;2\n', 'a list of 3'),
        ('a.txt', 'gps_delay_ms=1;2\n', 'a number'),
        ('a.txt', 'fusion_mode=1.5\n', 'an integer'),
        ('a.json', '{}', 'expected a .yaml'),
    ],
)
def test_bad_file_gets_one_sentence_that_names_it(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    path = written(tmp_path, name, text)
    with pytest.raises(ValueError, match=re.escape(words)) as caught:
        load_file(path)
    assert str(caught.value).startswith(str(path))
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('name', ['none.yaml', 'none.params', 'none.txt', 'folder.yaml'])
def test_unreadable_file_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / 'folder.yaml').mkdir()
    with pytest.raises(ValueError, match='cannot be read') as caught:
        load_file(tmp_path / name)
    assert name in str(caught.value)


def test_file_that_is_not_text_is_named(tmp_path: Path) -> None:
    for name in ('a.yaml', 'a.params', 'a.txt'):
        path = tmp_path / name
        path.write_bytes(b'\xff\xfe\x00\x01\x80')
        with pytest.raises(ValueError, match='not a') as caught:
            load_file(path)
        assert name in str(caught.value)
