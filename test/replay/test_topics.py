"""Choice of topics: by type, by request, and what is said of the rest."""

from __future__ import annotations

import pytest

storage = pytest.importorskip('ekf_fusion_ros.replay.storage')
topics = pytest.importorskip('ekf_fusion_ros.replay.topics')

ODOM, FIX, IMU = 'nav_msgs/msg/Odometry', 'sensor_msgs/msg/NavSatFix', 'sensor_msgs/msg/Imu'
TWIST = 'geometry_msgs/msg/TwistWithCovarianceStamped'
MAG = 'sensor_msgs/msg/MagneticField'
RANGE, BOOL = 'sensor_msgs/msg/Range', 'std_msgs/msg/Bool'
VECTOR, POSE = 'geometry_msgs/msg/Vector3Stamped', 'geometry_msgs/msg/PoseStamped'


def recording(*rows):
    return {name: storage.Topic(name, kind, count) for name, kind, count in rows}


def names(choice):
    return {role: topic.name for role, topic in choice.topics.items()}


def choose(available, **wanted):
    return topics.choose(available, wanted, 'flight')


def test_odometry_and_fix_leave_the_imu_out_and_say_so():
    choice = choose(recording(('/imu', IMU, 900), ('/odom', ODOM, 90), ('/fix', FIX, 9)))
    assert names(choice) == {'odometry': '/odom', 'fix': '/fix'}
    assert any('--topic imu=/imu' in line for line in choice.lines())


def test_without_odometry_the_autopilot_sensors_are_taken():
    choice = choose(recording(
        ('/imu', IMU, 900), ('/fix', FIX, 9), ('/fix_velocity', TWIST, 9), ('/mag', MAG, 90),
        ('/cmd_vel', TWIST, 90), ('/camera', 'sensor_msgs/msg/Image', 5)))
    assert names(choice) == {
        'imu': '/imu', 'fix': '/fix', 'fix_velocity': '/fix_velocity', 'magnetic_field': '/mag'}
    assert any('--topic fix_velocity=/cmd_vel' in line for line in choice.lines())
    assert not any('/camera' in line for line in choice.lines())


def test_asked_for_and_kept_out():
    available = recording(('/imu', IMU, 900), ('/odom', ODOM, 90), ('/fix', FIX, 9))
    assert names(choose(available, imu='/imu')) == {
        'odometry': '/odom', 'fix': '/fix', 'imu': '/imu'}
    assert names(choose(available, fix='')) == {'odometry': '/odom'}
    assert names(choose(available, odometry='')) == {'fix': '/fix', 'imu': '/imu'}


FURTHER = recording(
    ('/imu', IMU, 900), ('/fix', FIX, 9), ('/lidar', RANGE, 90), ('/px4flow', VECTOR, 90),
    ('/wind', VECTOR, 900), ('/airspeed', TWIST, 90), ('/armed', BOOL, 9), ('/landed', BOOL, 9),
    ('/landing_target/velocity', TWIST, 90),
    ('/gps/heading', POSE, 9), ('/goal_pose', POSE, 1))


def test_further_roles_stay_out_until_asked_for_and_it_is_said_how():
    choice = choose(FURTHER)
    assert names(choice) == {'imu': '/imu', 'fix': '/fix'}
    hints = [line.rsplit(' ', 1)[-1] for line in choice.remarks]
    assert hints == ['range=/lidar', 'flow=/px4flow', 'airspeed=/airspeed', 'armed=/armed',
                     'landed=/landed', 'aux_velocity=/landing_target/velocity',
                     'gps_heading=/gps/heading']


def test_further_roles_by_name():
    assert names(choose(FURTHER, range='/lidar', flow='/wind', landed='/armed')) == {
        'imu': '/imu', 'fix': '/fix', 'range': '/lidar', 'flow': '/wind', 'landed': '/armed'}


def test_further_roles_switched_on_by_parameters():
    every = ('range', 'flow', 'airspeed', 'landed', 'gps_heading', 'aux_velocity')
    choice = topics.choose(FURTHER, {'landed': ''}, 'flight', every)
    assert names(choice) == {
        'imu': '/imu', 'fix': '/fix', 'range': '/lidar', 'flow': '/px4flow',
        'airspeed': '/airspeed', 'gps_heading': '/gps/heading',
        'aux_velocity': '/landing_target/velocity'}
    assert 'left out as asked: /landed (std_msgs/msg/Bool)' in choice.remarks
    # The heading goes with the fix.
    assert 'gps_heading' not in names(topics.choose(FURTHER, {'fix': ''}, 'flight', every))


def test_roles_switched_off_by_parameters():
    available = recording(('/imu', IMU, 900), ('/odom', ODOM, 90), ('/fix', FIX, 9))
    choice = topics.choose(available, {}, 'flight', (), ('fix',))
    assert names(choice) == {'odometry': '/odom'}
    assert ('left out: /fix (sensor_msgs/msg/NavSatFix), switched off by node.use_fix; '
            'add it with --topic fix=/fix') in choice.remarks
    # What the user names wins, and the rest is chosen as without the topic.
    assert names(topics.choose(available, {'fix': '/fix'}, 'flight', (), ('fix',))) == {
        'odometry': '/odom', 'fix': '/fix'}
    assert names(topics.choose(available, {}, 'flight', (), ('odometry',))) == {
        'imu': '/imu', 'fix': '/fix'}
    with pytest.raises(storage.RecordingError, match=r'node\.use_odometry is false'):
        topics.choose(recording(('/odom', ODOM, 90)), {}, 'flight', (), ('odometry',))


def test_a_role_switched_on_without_a_topic_is_told():
    available = recording(('/odom', ODOM, 90), ('/gps/heading', POSE, 9))
    choice = topics.choose(available, {'flow': ''}, 'flight', ('range', 'gps_heading', 'flow'))
    told = [line for line in choice.remarks if 'switched on' in line]
    assert told == [
        'left out: range, switched on by node.use_range: no topic of the recording fits; '
        'name one with --topic range=/name',
        'left out: gps_heading, switched on by node.use_gps_heading, needs a fix topic beside it']


def test_of_several_the_choice_is_stable_and_said():
    available = recording(
        ('/b/odom', ODOM, 90), ('/a/odom', ODOM, 90), ('/odometry/filtered', ODOM, 900))
    choice = choose(available)
    assert names(choice) == {'odometry': '/a/odom'}
    assert any('instead of /a/odom with --topic odometry=/b/odom' in line
               for line in choice.lines())


@pytest.mark.parametrize(('wanted', 'words'), [
    ({'fix': '/nope'}, 'no topic /nope for role fix'),
    ({'fix': '/imu'}, 'takes sensor_msgs/msg/NavSatFix'),
    ({'odometry': '', 'imu': ''}, 'no inertial input'),
    ({'fix': '', 'fix_velocity': '/vel'}, 'needs a fix'),
])
def test_what_cannot_be_chosen(wanted, words):
    available = recording(
        ('/imu', IMU, 900), ('/odom', ODOM, 90), ('/fix', FIX, 9), ('/vel', TWIST, 9))
    with pytest.raises(storage.RecordingError, match=words):
        choose(available, **wanted)


def test_a_second_receiver_is_offered_and_never_plays_both_roles():
    two = recording(('/odom', ODOM, 90), ('/left/fix', FIX, 9), ('/right/fix', FIX, 8))
    line, = [line for line in choose(two).lines() if 'left out' in line]
    assert line.endswith('beside it with --topic fix_2=/right/fix')
    assert names(choose(two, fix_2='/left/fix'))['fix'] == '/right/fix'
    three = two | recording(('/top/fix', FIX, 7))
    line, = [line for line in choose(three, fix_2='/right/fix').lines() if 'left out' in line]
    assert line.endswith('beside it with --topic fix_3=/top/fix')
    choice = topics.choose(two, {}, 'flight', ('fix_2',))
    assert names(choice) == {'odometry': '/odom', 'fix': '/left/fix', 'fix_2': '/right/fix'}
    one = recording(('/odom', ODOM, 90), ('/fix', FIX, 9))
    assert 'fix_2' not in names(topics.choose(one, {}, 'flight', ('fix_2',)))


def test_a_recording_of_nothing_useful():
    with pytest.raises(storage.RecordingError, match='/camera'):
        choose(recording(('/camera', 'sensor_msgs/msg/Image', 5)))
