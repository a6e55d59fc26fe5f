"""Index map of the state: position, velocity, accelerometer bias, terrain.

Position and terrain in m NED of the local frame, velocity in m/s NED, bias in m/s^2 of the body
(FRD). Terrain is the down coordinate of the ground below, so that the height above it is
terrain minus down.
"""

from __future__ import annotations

SIZE = 10
POSITION = slice(0, 3)
VELOCITY = slice(3, 6)
ACCEL_BIAS = slice(6, 9)
PN, PE, PD = 0, 1, 2
VN, VE, VD = 3, 4, 5
TERRAIN = 9

STATES = {'position': POSITION, 'velocity': VELOCITY, 'accel_bias': ACCEL_BIAS,
          'terrain': slice(TERRAIN, SIZE)}
SECOND = 1_000_000
