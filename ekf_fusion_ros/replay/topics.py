"""Which topic of a recording plays which role; what is left out is said."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros import roles
from ekf_fusion_ros.replay.storage import RecordingError
from ekf_fusion_ros.replay.storage import Topic

TYPES: dict[str, tuple[str, ...]] = {
    roles.ODOMETRY: ('nav_msgs/msg/Odometry',),
    roles.FIX: ('sensor_msgs/msg/NavSatFix',),
    roles.FIX_VELOCITY: (
        'geometry_msgs/msg/TwistWithCovarianceStamped', 'geometry_msgs/msg/TwistStamped'),
    roles.IMU: ('sensor_msgs/msg/Imu',),
    roles.MAGNETIC_FIELD: ('sensor_msgs/msg/MagneticField',),
    roles.PRESSURE: ('sensor_msgs/msg/FluidPressure',),
    roles.RANGE: ('sensor_msgs/msg/Range',),
    roles.FLOW: ('geometry_msgs/msg/Vector3Stamped',),
    roles.AIRSPEED: (
        'geometry_msgs/msg/TwistWithCovarianceStamped', 'geometry_msgs/msg/TwistStamped'),
    roles.LANDED: ('std_msgs/msg/Bool',),
    roles.ARMED: ('std_msgs/msg/Bool',),
    roles.GPS_HEADING: (
        'geometry_msgs/msg/PoseWithCovarianceStamped', 'geometry_msgs/msg/PoseStamped',
        'sensor_msgs/msg/Imu'),
    roles.AUX_VELOCITY: (
        'geometry_msgs/msg/TwistWithCovarianceStamped', 'geometry_msgs/msg/TwistStamped'),
    roles.FIX_2: ('sensor_msgs/msg/NavSatFix',),
    roles.FIX_VELOCITY_2: (
        'geometry_msgs/msg/TwistWithCovarianceStamped', 'geometry_msgs/msg/TwistStamped'),
    roles.FIX_3: ('sensor_msgs/msg/NavSatFix',),
    roles.FIX_VELOCITY_3: (
        'geometry_msgs/msg/TwistWithCovarianceStamped', 'geometry_msgs/msg/TwistStamped'),
}
ALL_TYPES = frozenset(kind for kinds in TYPES.values() for kind in kinds)
WITH_ODOMETRY = (roles.ODOMETRY, roles.FIX)
WITHOUT_ODOMETRY = (
    roles.IMU, roles.FIX, roles.FIX_VELOCITY, roles.MAGNETIC_FIELD, roles.PRESSURE)
# A twist may as well be a command, a truth value may mean anything: the name must tell.
NAMES = {
    roles.FIX_VELOCITY: ('fix', 'gps', 'gnss', 'navsat'),
    roles.FIX_VELOCITY_2: ('fix', 'gps', 'gnss', 'navsat'),
    roles.FIX_VELOCITY_3: ('fix', 'gps', 'gnss', 'navsat'),
    roles.FLOW: ('flow',),
    roles.AIRSPEED: ('airspeed', 'air_speed', 'pitot'),
    roles.LANDED: ('landed', 'on_ground', 'ground_contact'),
    roles.ARMED: ('armed',),
    roles.GPS_HEADING: ('heading',),
    roles.AUX_VELOCITY: ('aux_velocity', 'landing_target', 'target_velocity'),
}
FURTHER = {
    roles.FIX: (roles.FIX_2, roles.FIX_3),
    roles.FIX_VELOCITY: (roles.FIX_VELOCITY_2, roles.FIX_VELOCITY_3),
}
"""Roles of the same kind of topic of further receivers."""

# Outputs of a fusion, this one's among them, are not its inputs.
OUTPUT_NAMES = ('odometry/filtered', 'odometry/gps', 'gps/filtered')


@dataclass(slots=True)
class Choice:
    """Topic of each role in use, and the sentences that explain the choice."""

    topics: dict[str, Topic] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        """Return the choice in words, one line a topic."""
        used = [f'{role}: {topic.name} ({topic.type}, {topic.count} messages)'
                for role, topic in self.topics.items()]
        return used + self.remarks


def choose(
    available: Mapping[str, Topic], wanted: Mapping[str, str], recording: str,
    switched_on: Collection[str] = (), switched_off: Collection[str] = (),
) -> Choice:
    """Return the topics to fuse.

    `wanted` maps a role to the topic asked for, '' to keep the role out. Roles not named there
    are filled by type: those that are usual for the recording unless parameters have them
    `switched_off`, and those that parameters have `switched_on`. Raises RecordingError where a
    topic is missing or of the wrong type, or nothing could be fused.
    """
    choice = Choice()
    for role, name in wanted.items():
        if name:
            choice.topics[role] = _asked_for(available, role, name, recording)
    off = [role for role in switched_off if role not in wanted]
    on = [role for role in switched_on if role not in wanted]
    _fill(choice, available, on, {*off, *wanted})
    _remark(choice, available, wanted, off)
    choice.remarks += [_without_topic(role, choice) for role in on if role not in choice.topics]
    try:
        roles.check_roles(choice.topics)
    except ValueError as error:
        have = ', '.join(f'{topic.name} ({topic.type})' for topic in available.values())
        told = ''.join(f'{_switch(role)} is false, ' for role in off)
        raise RecordingError(
            f'{recording}: {error}; {told}the recording has {have or "none"}') from None
    return choice


def _fill(
    choice: Choice, available: Mapping[str, Topic], switched_on: Collection[str],
    settled: Collection[str],
) -> None:
    """Add topics by type for the usual roles and those switched on, but for `settled` ones."""
    candidates = {role: _candidates(available, role) for role in TYPES}
    has_odometry = roles.ODOMETRY in choice.topics or (
        roles.ODOMETRY not in settled and bool(candidates[roles.ODOMETRY]))
    usual = WITH_ODOMETRY if has_odometry else WITHOUT_ODOMETRY
    for role in (*usual, *switched_on):
        taken = [topic.name for topic in choice.topics.values()]
        free = [topic for topic in candidates[role] if topic.name not in taken]
        if role not in settled and free:
            choice.topics[role] = free[0]
    for role, fix in roles.NEEDED.items():
        if fix not in choice.topics and role not in settled:
            choice.topics.pop(role, None)
    choice.topics = {role: choice.topics[role] for role in TYPES if role in choice.topics}


def _switch(role: str) -> str:
    return f'node.use_{role}'


def _without_topic(role: str, choice: Choice) -> str:
    """Say why a role that parameters switch on has no topic."""
    fix = roles.NEEDED.get(role)
    if fix is not None and fix not in choice.topics:
        return f'left out: {role}, switched on by {_switch(role)}, needs a {fix} topic beside it'
    return (f'left out: {role}, switched on by {_switch(role)}: no topic of the recording '
            f'fits; name one with --topic {role}=/name')


def _asked_for(available: Mapping[str, Topic], role: str, name: str, recording: str) -> Topic:
    topic = available.get(name) or available.get(f'/{name}')
    if topic is None:
        have = ', '.join(one.name for one in available.values() if one.type in TYPES[role])
        raise RecordingError(
            f'{recording}: has no topic {name} for role {role}; topics of a suitable type: '
            f'{have or "none"}')
    if topic.type not in TYPES[role]:
        raise RecordingError(
            f'{recording}: topic {name} is {topic.type}, but role {role} takes '
            f'{" or ".join(TYPES[role])}')
    return topic


def _candidates(available: Mapping[str, Topic], role: str) -> list[Topic]:
    """Return the topics that could play a role, the likeliest first, the same every time."""
    found = [topic for topic in available.values() if topic.type in TYPES[role]
             and topic.count > 0 and (role not in NAMES or _is_named_for(topic, role))]
    found.sort(key=lambda topic: (topic.name.endswith(OUTPUT_NAMES), -topic.count, topic.name))
    return found


def _is_named_for(topic: Topic, role: str) -> bool:
    return any(word in topic.name.lower() for word in NAMES.get(role, ()))


def _likely_role(topic: Topic) -> str | None:
    """Return the role that a topic could play: by its name, or by a type that says enough."""
    able = [role for role, kinds in TYPES.items() if topic.type in kinds]
    named = [role for role in able if _is_named_for(topic, role)]
    plain = [role for role in able if role not in NAMES or role == roles.FIX_VELOCITY]
    return next(iter(named + plain), None)


def _remark(
    choice: Choice, available: Mapping[str, Topic], wanted: Mapping[str, str],
    switched_off: Collection[str],
) -> None:
    """Say which topics were left out and how each could be added."""
    used = {topic.name for topic in choice.topics.values()}
    for topic in available.values():
        role = _likely_role(topic)
        if role is None or topic.name in used:
            continue
        taken = choice.topics.get(role)
        verb = 'use it instead of ' + taken.name if taken else 'add it'
        if topic.count == 0:
            choice.remarks.append(f'left out: {topic.name} ({topic.type}) holds no messages')
        elif role in wanted and not wanted[role]:
            choice.remarks.append(f'left out as asked: {topic.name} ({topic.type})')
        else:
            why = f', switched off by {_switch(role)}' if role in switched_off else ''
            choice.remarks.append(f'left out: {topic.name} ({topic.type}){why}; {verb} with '
                                  f'--topic {role}={topic.name}{_beside(role, topic, choice)}')


def _beside(role: str, topic: Topic, choice: Choice) -> str:
    """Say how a topic of a further receiver joins those in use."""
    further = FURTHER.get(role, ())
    free = next((one for one in further if one not in choice.topics), None)
    if role not in choice.topics or free is None:
        return ''
    return f', beside it with --topic {free}={topic.name}'
