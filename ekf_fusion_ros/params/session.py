"""Parameters of a fusion session: what lies between messages and estimator."""

from __future__ import annotations

from dataclasses import dataclass

from ekf_fusion_ros.params.spec import param


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionParams:
    """Outputs, order of stamps, pairing, and how roles choose the aiding."""

    output_rate: float = param(
        50.0, 'Rate of the outputs by the stamps of the inertial input; 0 = one for every filter '
        'update.', unit='Hz', min=0, max=1000)
    automatic_aiding: bool = param(
        True, 'Let the roles in use choose height reference, magnetometer and odometry aiding. A '
        'value of ekf2 or lpe that differs from its default wins.')
    horizon_ms: float = param(
        200.0, 'Shortest delay of the fusion horizon: the time by which messages may be late '
        'after their stamp.', unit='ms', min=0, max=2000)
    hold_ms: float = param(
        20.0, 'Time for which aiding messages are held to bring them into the order of their '
        'stamps, whatever the order of arrival.', unit='ms', min=0, max=1000)
    odometry_delay_ms: float = param(
        0.0, 'Delay of odometry stamps against the inertial input; a stamp by REP-103 habit is '
        'the time of measurement. Replaces the default of ekf2.vision.delay_ms.', unit='ms',
        min=0, max=1000)
    origin_from: str = param(
        'first_fix', 'What sets the origin of the map: the first good fix, or `session.origin`.',
        choices=('first_fix', 'parameter'))
    origin: tuple[float, float, float] = param(
        (0.0, 0.0, 0.0), 'Fixed origin of the map: latitude and longitude in deg, altitude in m '
        'in the datum of the fixes. Used with `session.origin_from: parameter`, which needs it.')
    stamp_gap_max: float = param(
        5.0, 'Step of the inertial stamps above which the estimator starts again, once a second '
        'message confirms it.', unit='s', min=0.5, max=60)
    gap_notice: float = param(
        0.5, 'Gap in the inertial stamps above which it is told as an event.', unit='s',
        min=0.01, max=60)
    stamp_lead_max: float = param(
        2.0, 'Time by which an aiding stamp may lie ahead of the inertial stamps.', unit='s',
        min=0.1, max=60)
    stamp_age_max: float = param(
        0.5, 'Age against the inertial stamps above which an aiding message is refused; less '
        'where the fusion horizon (horizon_ms) could not take it any more.',
        unit='s', min=0.05, max=60)
    pairing_tolerance: float = param(
        0.05, 'Largest difference of stamps of a fix and the velocity that belongs to it.',
        unit='s', min=0, max=1)
    pairing_wait: float = param(
        0.2, 'Time by inertial stamps that a fix waits for its velocity or heading; less where '
        'the fusion horizon could not take it any more.', unit='s', min=0,
        max=2)
