"""Units at the boundaries; inside, everything is SI and radians."""

import math

KM = 1000.0
NM = 1852.0
KMH = 1.0 / 3.6
KT = NM / 3600.0
FOOT = 0.3048
FLIGHT_LEVEL = 100.0 * FOOT
DEG = math.pi / 180.0
TURN = 2.0 * math.pi
G0 = 9.80665
DAY = 86400.0
