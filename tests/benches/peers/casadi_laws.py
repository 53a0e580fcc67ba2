"""Generates C code for the control step of the PUMA 560 with CasADi: laws.c and laws.h in the working directory.

The laws are those of src/control with one difference: the damping is constant, because singular values cannot be computed symbolically.
"""

from math import cos, pi, sin

from casadi import SX, CodeGenerator, Function, atan2, horzcat, mtimes, sqrt, vertcat
from casadi import cos as cosine
from casadi import sin as sine

ALPHA = (0, -pi / 2, 0, -pi / 2, pi / 2, -pi / 2)
A = (0, 0, 0.4318, 0.019, 0, 0)
D = (0, 0, 0.125, 0.432, 0, 0)
GAIN, DAMPING = 185.0, 0.05


def exact(number):
    """Rounds cos(pi/2) to an exact zero, which CasADi can simplify."""
    return 0.0 if abs(number) < 1e-15 else number


def product(a, b):
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def solve(matrix, right):
    """Solves by an L D Lᵀ decomposition."""
    n = matrix.shape[0]
    lower, pivots = [[None] * n for _ in range(n)], []
    for j in range(n):
        scaled = [lower[j][k] * pivots[k] for k in range(j)]
        pivots.append(matrix[j, j] - sum(lower[j][k] * scaled[k] for k in range(j)))
        for i in range(j + 1, n):
            lower[i][j] = (matrix[i, j] - sum(lower[i][k] * scaled[k] for k in range(j))) / pivots[j]
    forward = []
    for i in range(n):
        forward.append(right[i] - sum(lower[i][k] * forward[k] for k in range(i)))
    solution = [None] * n
    for i in reversed(range(n)):
        solution[i] = forward[i] / pivots[i] - sum(lower[k][i] * solution[k] for k in range(i + 1, n))
    return vertcat(*solution)


theta, goal = SX.sym("theta", 6), SX.sym("goal", 8)
x, y, z, point = ([SX(v) for v in axis] for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)))
real, axes = [SX(1), SX(0), SX(0), SX(0)], []
for i in range(6):
    c, s = exact(cos(ALPHA[i])), exact(sin(ALPHA[i]))
    point = [point[k] + A[i] * x[k] for k in range(3)]
    y, z = [c * y[k] + s * z[k] for k in range(3)], [c * z[k] - s * y[k] for k in range(3)]
    point = [point[k] + D[i] * z[k] for k in range(3)]
    axes.append((z, point))
    half_cos, half_sin = cosine(0.5 * theta[i]), sine(0.5 * theta[i])
    c, s = 1 - 2 * half_sin * half_sin, 2 * half_sin * half_cos
    x, y = [c * x[k] + s * y[k] for k in range(3)], [c * y[k] - s * x[k] for k in range(3)]
    link = [exact(cos(ALPHA[i] / 2)), exact(sin(ALPHA[i] / 2)), 0, 0]
    real = product(product(real, link), [half_cos, 0, 0, half_sin])
dual = [0.5 * v for v in product([0, *point], real)]
pose = vertcat(*real, *dual)

columns = []
for direction, at in axes:
    line, moment = [0, *direction], [0, *cross(at, direction)]
    of_dual = [a + b for a, b in zip(product(line, dual), product(moment, real))]
    columns.append(vertcat(*[0.5 * v for v in product(line, real) + of_dual]))

error = [goal[k] - pose[k] for k in range(8)]
moment = [a + b for a, b in zip(product(error[:4], conjugate(real)), product(error[4:], conjugate(dual)))][1:]
force = product(error[4:], conjugate(real))[1:]
pull = [[m + f for m, f in zip(moment, cross(force, at))] for _, at in axes]
diffc = vertcat(*[0.5 * GAIN * dot(direction, along) for (direction, _), along in zip(axes, pull)])

goal_real, goal_dual = [goal[k] for k in range(4)], [goal[4 + k] for k in range(4)]
goal_point = [2 * v for v in product(goal_dual, conjugate(goal_real))][1:]
turn, way = product(goal_real, conjugate(real)), [g - p for g, p in zip(goal_point, point)]
lever = lambda at: [p - a for p, a in zip(point, at)]
jacobian = horzcat(*[vertcat(*direction, *cross(direction, lever(at))) for direction, at in axes])
gram = mtimes(jacobian, jacobian.T) + DAMPING**2 * SX.eye(6)
unit_quaternion = mtimes(jacobian.T, solve(gram, vertcat(*[2 * v for v in turn[1:]], *way)))

half_sine = sqrt(dot(turn[1:], turn[1:]))
angle = 2 * atan2(half_sine, turn[0])
omega = [angle / half_sine * v for v in turn[1:]]
alpha = 0.5 * angle * turn[0] / half_sine
beta = (1 - alpha) / (angle * angle)
linear = [alpha * w - 0.5 * c + beta * dot(omega, way) * o for w, c, o in zip(way, cross(omega, way), omega)]
logc = mtimes(jacobian.T, solve(gram, vertcat(*omega, *linear)))

generator = CodeGenerator("laws.c", {"with_header": True})
results = {"kinematics": pose, "pose_jacobian": horzcat(*columns), "diffc": diffc}
results |= {"unit_quaternion": unit_quaternion, "logc": logc}
for name, result in results.items():
    generator.add(Function(name, [theta, goal], [result]))
generator.generate()
