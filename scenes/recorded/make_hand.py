#!/usr/bin/env python3
"""Writes hand.csv: a grasper led by a hand, as an optical tracker of 30 Hz would see it. Nobody's data: minimum-jerk
moves between poses (Flash and Hogan 1985), the tremor of a hand at 9 Hz and the noise of a tracker. The tracker has its
own habits, so that hand.xml has something to undo: mm, ms, a left-handed frame with z upwards, x y z w quaternions of a
tool that points along its +z, jaws by their opening in degrees.

    python3 make_hand.py > hand.csv
"""
import math

AT_REST, TWISTED = (0.928064, 0.162212, 0.335238, 0), (0.710938, 0.339748, 0.152539, 0.596548)
# s, m in the frame of the organs, orientation w x y z, opening of the jaws in degrees
POSES = [
    (0.0, (-0.020, -0.062, 0.066), AT_REST, 40),
    (0.4, (-0.020, -0.062, 0.066), AT_REST, 40),
    (1.4, (-0.050, -0.040, 0.0305), AT_REST, 4),  # closed in the air: they hold nothing
    (2.2, (-0.0525, -0.0385, 0.020), AT_REST, 4),  # press
    (2.7, (-0.0525, -0.0385, 0.020), AT_REST, 4),
    (3.9, (-0.058, -0.053, 0.0270), AT_REST, 4),  # slide towards the fundus
    (4.5, (-0.056, -0.062, 0.043), AT_REST, 40),
    (5.2, (-0.060, -0.0635, 0.0322), AT_REST, 40),  # touch the fundus
    (5.5, (-0.060, -0.0635, 0.0322), AT_REST, 4),  # grab
    (5.7, (-0.060, -0.0635, 0.0322), AT_REST, 4),
    (7.0, (-0.042, -0.075, 0.049), AT_REST, 4),  # pull
    (7.2, (-0.042, -0.075, 0.049), AT_REST, 4),
    (8.1, (-0.042, -0.075, 0.049), TWISTED, 4),  # twist
    (8.3, (-0.042, -0.075, 0.049), TWISTED, 40),  # let go
    (9.4, (-0.015, -0.070, 0.074), AT_REST, 40),
    (9.7, (-0.015, -0.070, 0.074), AT_REST, 40),
]
RATE, START = 30, 48200  # Hz, ms on the tracker's clock
OFFSET = (-0.03, -0.05, 0.02)  # m, of the tracker's origin in the organs' frame

state = 1


def noise():
    """About normal with deviation 1: twelve numbers of a linear congruential generator (Knuth's MMIX)."""
    global state
    total = -6.0
    for _ in range(12):
        state = (6364136223846793005 * state + 1442695040888963407) % 2**64
        total += (state >> 11) / 2**53
    return total


def multiply(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def pose_at(t):
    for (t0, p0, q0, jaw0), (t1, p1, q1, jaw1) in zip(POSES, POSES[1:]):
        if t <= t1:
            break
    s = min(max((t - t0) / (t1 - t0), 0), 1)
    s = s**3 * (10 + s * (6 * s - 15))
    blend = lambda a, b: tuple(x + s * (y - x) for x, y in zip(a, b))
    q = blend(q0, q1)
    length = math.sqrt(sum(x * x for x in q))
    return blend(p0, p1), tuple(x / length for x in q), jaw0 + s * (jaw1 - jaw0)


def main():
    print("stamp[ms],x[mm],y[mm],z[mm],qx,qy,qz,qw,jaw[deg]")
    half = math.sqrt(0.5)
    for k in range(int(POSES[-1][0] * RATE) + 1):
        t = k / RATE
        p, q, jaw = pose_at(t)
        swing = [math.sin(2 * math.pi * 9 * t + phase) for phase in (0, 2, 4)]
        p = [a - o + 1.5e-4 * w + 3e-5 * noise() for a, o, w in zip(p, OFFSET, swing)]
        # The organs stand up by a quarter turn about x, y to z; then z is turned over.
        x, y, z = p[0], -p[2], p[1]
        p = (x, y, -z)
        q = multiply((half, half, 0, 0), multiply(q, (0, -1, 0, 0)))  # the tool's z points ahead: half a turn about x
        q = (q[0], -q[1], -q[2], q[3])
        print("%d,%s,%s,%.1f" % (START + round(1000 * t), ",".join("%.3f" % (1000 * x) for x in p),
                                 ",".join("%.5f" % x for x in (q[1], q[2], q[3], q[0])), jaw + 0.3 * noise()))


main()
