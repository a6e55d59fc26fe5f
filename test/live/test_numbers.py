"""Values a plot can draw."""

from __future__ import annotations

from ekf_fusion_ros.live.numbers import single_numbers


def test_vectors_are_split_and_words_left_out():
    values = {'state.velocity': '1.5 -2 nan', 'resets': '3', 'flags': 'yaw_align, gps',
              'valid': 'true', 'nothing': ''}
    assert single_numbers(values) == {
        'state.velocity.0': '1.5', 'state.velocity.1': '-2', 'state.velocity.2': 'nan',
        'resets': '3'}
