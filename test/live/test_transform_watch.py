"""Only one may publish a transform to a child; the other is told which and what to do."""

from __future__ import annotations

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.transform_watch import FOREIGN_S
from ekf_fusion_ros.live.transform_watch import OWN_KEPT
from ekf_fusion_ros.live.transform_watch import TransformWatch

OWN = (5, 1.0, 2.0, 3.0)
OTHER = (5, 1.0, 2.0, 3.5)


def test_its_own_transform_coming_back_is_no_foreign_one() -> None:
    watch = TransformWatch('map', 'odom')
    assert watch.sentence(0.0) == 'map -> odom waits for the first estimate'
    watch.note_own(OWN)
    watch.hear('map', OWN, 0.0)
    assert watch.free(0.0)
    assert watch.news(0.0) == ''
    assert watch.report(0.0).text == 'publishing map -> odom'
    assert watch.report(0.0).level == HealthLevel.OK


def test_old_ones_of_its_own_are_forgotten() -> None:
    watch = TransformWatch('map', 'odom')
    for stamp in range(OWN_KEPT + 1):
        watch.note_own((stamp, 0.0, 0.0, 0.0))
    watch.hear('map', (1, 0.0, 0.0, 0.0), 0.0)
    assert watch.free(0.0)
    watch.hear('map', (0, 0.0, 0.0, 0.0), 0.0)
    assert not watch.free(0.0)


def test_another_publisher_stops_it_until_it_has_been_silent_for_long() -> None:
    watch = TransformWatch('map', 'odom')
    watch.note_own(OWN)
    watch.hear('/world', OTHER, 10.0)
    assert not watch.free(10.0)
    line = watch.news(10.0)
    assert line == ('map -> odom is not published: another node publishes world -> odom; stop '
                    'that, or set node.publish_tf to false')
    assert watch.news(11.0) == ''
    assert (watch.report(11.0).level, watch.report(11.0).text) == (HealthLevel.WARN, line)
    assert not watch.free(10.0 + FOREIGN_S)
    later = 10.1 + FOREIGN_S
    assert watch.free(later)
    assert watch.news(later) == 'publishing map -> odom'


def test_trouble_is_reported() -> None:
    watch = TransformWatch('map', 'odom')
    watch.trouble = 'the odometry is elsewhere'
    assert watch.report(0.0).text == 'map -> odom is not published: the odometry is elsewhere'
    assert watch.report(0.0).level == HealthLevel.WARN
