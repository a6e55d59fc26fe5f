"""The sentence of state: the nearest reason why nothing comes, else the health itself."""

from __future__ import annotations

from dataclasses import replace

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.publishers_seen import PublisherSeen
from ekf_fusion_ros.live.publishers_seen import publishers_phrase
from ekf_fusion_ros.live.situation import InputSeen
from ekf_fusion_ros.live.situation import situation
from ekf_fusion_ros.statistics import RoleStatistics

FIX = 'sensor_msgs/msg/NavSatFix'
FINE = Health(HealthLevel.OK, 'ok: fusing GNSS', {'resets': '0'})
ODOMETRY = InputSeen('odometry', '/odom', RoleStatistics(9, 9), 0.05, lambda: '1 publisher')


def test_publishers_are_counted_by_reliability() -> None:
    best = PublisherSeen('best-effort', FIX)
    assert publishers_phrase([], FIX) == 'no publisher'
    assert publishers_phrase([best, best], FIX) == '2 best-effort publishers'
    assert publishers_phrase([PublisherSeen('reliable', FIX)], FIX) == '1 reliable publisher'
    assert publishers_phrase(
        [best, PublisherSeen('reliable', FIX)], FIX) == '1 best-effort and 1 reliable publishers'


def test_publishers_of_another_type_are_named() -> None:
    seen = [PublisherSeen('reliable', 'sensor_msgs/msg/Imu')]
    assert publishers_phrase(seen, FIX) == (
        '1 of type sensor_msgs/msg/Imu instead of sensor_msgs/msg/NavSatFix')


def test_a_missing_fix_is_said_with_its_publishers() -> None:
    missing = InputSeen('fix', '/fix', RoleStatistics(), None, lambda: '2 best-effort publishers')
    said = situation(FINE, missing, ODOMETRY)
    assert said.text == 'waiting for a fix: /fix has 0 messages, 2 best-effort publishers'
    assert said.level == HealthLevel.WARN
    assert said.values == FINE.values


def test_unusable_messages_are_said_with_reason() -> None:
    counts = RoleStatistics(received=3)
    counts.refuse('no_fix', 'status -1')
    counts.refuse('bad_latitude', 'latitude 91')
    counts.refuse('no_fix', 'status -1')
    said = situation(FINE, InputSeen('fix', '/fix', counts, 0.1, str), ODOMETRY)
    assert said.text == (
        'waiting for a usable fix: /fix has 3 messages, refused: 1 bad_latitude, 2 no_fix; '
        'the last: no_fix: status -1')


def test_silence_of_the_inertial_input_is_an_error() -> None:
    said = situation(FINE, None, replace(ODOMETRY, age=4.2))
    assert said.level == HealthLevel.ERROR
    assert said.text == 'no odometry for 4 s: /odom has 1 publisher'


def test_a_disabled_node_says_so_before_all_else() -> None:
    missing = InputSeen('fix', '/fix', RoleStatistics(), None, str)
    assert situation(FINE, missing, ODOMETRY, enabled=False).text.startswith('disabled:')


def test_all_well_is_passed_on() -> None:
    assert situation(FINE, None, ODOMETRY) is FINE
