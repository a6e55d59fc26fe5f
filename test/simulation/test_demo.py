"""The demo from end to end, on one flight."""

import re

import pytest

from ekf_fusion_ros.simulation import demo


@pytest.mark.slow
def test_fusion_beats_both_sources(tmp_path, capsys):
    pytest.importorskip('rosbags')
    pytest.importorskip('matplotlib')
    status = demo.main(['--output', str(tmp_path), '--seed', '11'])
    said = capsys.readouterr().out
    table = {
        where: [float(number) for number in re.findall(r'\d+\.\d+', rest)]
        for where, rest in re.findall(r'(outside|outage) +(.*)', said)
    }
    assert status == 0, said
    for where in ('outside', 'outage'):
        fused, _, odometry, _, gps, _, ratio, _ = table[where]
        assert fused <= 0.6 * min(odometry, gps)
        assert ratio == pytest.approx(fused / min(odometry, gps), abs=0.02)
    # The GPS of the demo has 1.5 m and 0.4 m of noise on both horizontal axes.
    assert table['outside'][4] == pytest.approx(2 ** 0.5 * (1.5 ** 2 + 0.4 ** 2) ** 0.5, rel=0.1)
    for left in ('demo.png', 'seed-11/truth.csv', 'seed-11/replay/fused/metadata.yaml'):
        assert (tmp_path / left).exists()
    assert str(tmp_path / 'demo.png') in said
