"""Windows in which messages are kept back."""

from __future__ import annotations

from ekf_fusion_ros.replay.withholding import Withholding

START = 1_432_235_498_025_043


def test_windows_are_half_open_and_count_from_the_start():
    windows = Withholding({'fix': [(1.0, 2.0), (5.0, 6.0)]}, START)
    inside = [1_000_000, 1_999_999, 5_000_000]
    outside = [0, 999_999, 2_000_000, 4_999_999, 6_000_000]
    assert all(windows.holds('fix', START + at) for at in inside)
    assert not any(windows.holds('fix', START + at) for at in outside)
    assert not windows.holds('imu', START + 1_500_000)


def test_fix_takes_its_velocity_along_and_not_the_other_way():
    windows = Withholding({'fix': [(1.0, 2.0)], 'fix_velocity': [(8.0, 9.0)]}, START)
    assert windows.holds('fix_velocity', START + 1_500_000)
    assert windows.holds('gps_heading', START + 1_500_000)
    assert windows.holds('fix_velocity', START + 8_500_000)
    assert not windows.holds('fix', START + 8_500_000)


def test_each_receiver_is_withheld_by_itself():
    windows = Withholding({'fix_2': [(1.0, 2.0)]}, START)
    inside = START + 1_500_000
    assert windows.holds('fix_2', inside) and windows.holds('fix_velocity_2', inside)
    assert not windows.holds('fix', inside) and not windows.holds('fix_velocity', inside)
