"""How different two pictures look: LDR-FLIP (Andersson and others 2020), with numpy alone.

difference(a, b): both rows x columns x 3, linear Rec.709 as they are shown, clipped to [0, 1]. Returns
a map in [0, 1], 0 where nobody sees a difference; its mean is the usual figure. Seen at 67 pixels a
degree (0.7 m from a screen 0.7 m and 3840 pixels wide), as in the paper.
"""
import numpy as np

PIXELS_A_DEGREE = 67
TO_XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                   [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                   [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])  # sRGB, D65
WHITE = TO_XYZ.sum(axis=1)


def opponent(linear):
    """Y, Cx, Cz: luminance, red-green, blue-yellow."""
    x, y, z = np.moveaxis(linear @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def linear_of(opponents):
    y = (opponents[..., 0] + 16) / 116
    xyz = np.stack([y + opponents[..., 1] / 500, y, y - opponents[..., 2] / 200], -1)
    return np.clip(xyz * WHITE @ np.linalg.inv(TO_XYZ).T, 0, 1)


def lab_with_hunt(linear):
    """CIELAB whose colours count less where it is dark."""
    t = linear @ TO_XYZ.T / WHITE
    d = 6 / 29
    f = np.where(t > d**3, np.cbrt(t), t / (3 * d * d) + 4 / 29)
    light = 116 * f[..., 1] - 16
    a, b = 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])
    return np.stack([light, 0.01 * light * a, 0.01 * light * b], -1)


def hyab(a, b):
    d = a - b
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def across(image, kernel, axis):
    """Convolution along an axis, borders repeated."""
    r = len(kernel) // 2
    padded = np.pad(image, [(r, r) if i == axis else (0, 0) for i in range(image.ndim)], "edge")
    length = image.shape[axis]
    return sum(k * np.take(padded, np.arange(i, i + length), axis) for i, k in enumerate(kernel))


def seen(opponents):
    """What the eye's contrast sensitivity leaves of each channel."""
    out = np.empty_like(opponents)
    for c, parts in enumerate([[(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]):
        r = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi**2)) * PIXELS_A_DEGREE))  # of the widest of all
        x = np.arange(-r, r + 1) / PIXELS_A_DEGREE
        total, size = 0, 0
        for a, b in parts:
            g = np.exp(-np.pi**2 * x * x / b)
            weight = a * np.sqrt(np.pi / b)
            total = total + weight * across(across(opponents[..., c], g, 0), g, 1)
            size += weight * g.sum()**2
        out[..., c] = total / size
    return out


def features(y):
    """Strengths of edges and of points in a grey picture."""
    sigma = 0.5 * 0.082 * PIXELS_A_DEGREE
    r = int(np.ceil(3 * sigma))
    x = np.arange(-r, r + 1.0)
    g = np.exp(-x * x / (2 * sigma**2))
    strengths = []
    for k in (-x * g, (x * x / sigma**2 - 1) * g):
        k = np.where(k > 0, k / k[k > 0].sum(), k / -k[k < 0].sum())
        strengths.append(np.hypot(across(across(y, k, 1), g / g.sum(), 0),
                                  across(across(y, k, 0), g / g.sum(), 1)))
    return strengths


def difference(a, b):
    a, b = np.clip(a, 0, 1), np.clip(b, 0, 1)
    oa, ob = opponent(a), opponent(b)
    power, knee, high = 0.7, 0.4, 0.95
    delta = hyab(lab_with_hunt(linear_of(seen(oa))), lab_with_hunt(linear_of(seen(ob))))**power
    most = hyab(lab_with_hunt(np.array([0., 1, 0])), lab_with_hunt(np.array([0., 0, 1])))**power
    colour = np.where(delta < knee * most, delta * high / (knee * most),
                      high + (delta - knee * most) / (most - knee * most) * (1 - high))
    fa, fb = features((oa[..., 0] + 16) / 116), features((ob[..., 0] + 16) / 116)
    change = np.maximum(np.abs(fa[0] - fb[0]), np.abs(fa[1] - fb[1]))
    return np.clip(colour, 0, 1)**(1 - np.clip(np.sqrt(change / np.sqrt(2)), 0, 1))
